"""Setting a rig up: devices found, a draft of its file with faults and advice, the file, opening it."""
