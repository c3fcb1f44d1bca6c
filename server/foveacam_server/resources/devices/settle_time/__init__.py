"""The settle time in use: the rig file's or a measured one."""
