"""Pairs with truth to train stereo networks on, of the simulated rig."""
