"""Calibration sessions: folders of measurements, and the steps that fill them."""
