"""Tests of the pages of calibration, in a browser."""
