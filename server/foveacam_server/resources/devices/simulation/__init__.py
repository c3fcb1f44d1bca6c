"""Faults of the simulated rig, made and mended on request."""
