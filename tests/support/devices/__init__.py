"""Devices and far ends of tests."""
