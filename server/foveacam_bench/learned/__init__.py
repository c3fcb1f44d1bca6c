"""Stereo networks: pairs with truth from the simulated rig, accuracy, and the network that ships."""
