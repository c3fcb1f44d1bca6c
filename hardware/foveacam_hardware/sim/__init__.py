"""The simulated rig: world, optics, mirror dynamics, cameras and far ends, with physics of its own."""
