"""Drift checks: looks into the scene that measure the drift of the eyes' mounts."""
