"""Screens that show a calibration pattern at its true size, and the pattern."""
