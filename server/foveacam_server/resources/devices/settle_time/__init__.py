"""The settle time in use: the wait after every move, from the rig file or measured."""
