"""Stages 2 and 3, fitting: from raw sweeps to the calibration of a rig, and the check of it."""
