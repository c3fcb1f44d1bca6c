"""Faults injected into the simulated rig, and their removal."""
