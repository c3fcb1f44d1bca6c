"""Set-up of a rig: found devices, a draft of the rig file with faults and advice, saving, opening."""
