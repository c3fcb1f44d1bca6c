"""Follows targets: image trackers, a filter of position and velocity, and the sharing of two foveae."""
