"""Calibrations kept, compared and put together."""
