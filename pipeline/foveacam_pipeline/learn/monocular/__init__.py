"""Relative inverse depth from one picture: a small network, its training, and its use as a prior."""
