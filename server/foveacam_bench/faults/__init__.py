"""Faults of devices, lines and disk: how long until they are noticed and repaired."""
