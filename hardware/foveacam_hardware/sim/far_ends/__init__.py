"""The far ends of the wires: what answers where a real rig has a device."""
