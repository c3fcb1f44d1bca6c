"""Targets that are followed: both foveae look at one after the other."""
