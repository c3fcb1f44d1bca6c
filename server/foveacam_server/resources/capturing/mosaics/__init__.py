"""Mosaics of captures, computed in child processes."""
