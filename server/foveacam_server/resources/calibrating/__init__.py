"""Calibrating the rig: sessions of measurements, calibrations, checks for drift."""
