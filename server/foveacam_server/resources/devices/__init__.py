"""Resources of the rig's devices: set-up, cameras, mirrors, positioners, displays, faults, the stop."""
