"""The rig's devices: setting them up, cameras, mirrors, positioners, displays, faults, the stop."""
