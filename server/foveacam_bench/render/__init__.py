"""The renderer of the simulated rig: speed, memory and accuracy."""
