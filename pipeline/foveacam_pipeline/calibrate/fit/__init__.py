"""Stages 2 and 3, fitting: reduction of raw sweeps, the calibration of a rig, and its check."""
