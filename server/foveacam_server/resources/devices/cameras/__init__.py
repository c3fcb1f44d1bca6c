"""Cameras: their settings, one exposure for both foveae, and the test of their trigger."""
