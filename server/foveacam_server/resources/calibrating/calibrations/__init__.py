"""The rig's calibrations: which is in force, its health, import, export and report."""
