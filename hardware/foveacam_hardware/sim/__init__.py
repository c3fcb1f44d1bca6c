"""The simulated rig: world, optics, mirror dynamics, cameras, far ends. Its own physics throughout."""
