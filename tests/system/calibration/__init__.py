"""Tests of calibrations on a whole server."""
