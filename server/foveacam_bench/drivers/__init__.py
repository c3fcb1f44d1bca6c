"""Benches of the device drivers: cameras against a bare loop, and the mirror controller's serial link."""
