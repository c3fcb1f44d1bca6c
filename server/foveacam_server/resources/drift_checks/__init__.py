"""Drift checks: a few looks into the scene that say how the mounts moved."""
