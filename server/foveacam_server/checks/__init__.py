"""Checks of the machine and of the devices of a rig; `foveacam doctor` runs them all."""
