"""Calibration sessions on disk, the steps that fill them, and their REST documents; for server and CLI."""
