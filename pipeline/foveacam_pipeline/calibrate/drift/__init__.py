"""Drift checks, corrections and health of a calibration in the field."""
