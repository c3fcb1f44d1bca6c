"""Calibrations on disk: stored, compared, and sweeps of several sessions combined."""
