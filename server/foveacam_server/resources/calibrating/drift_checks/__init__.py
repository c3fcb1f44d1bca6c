"""Drift checks: looks into the scene that measure how far the mounts moved."""
