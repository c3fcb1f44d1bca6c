"""Calibration sessions: folders of measurements, and the steps that make them."""
