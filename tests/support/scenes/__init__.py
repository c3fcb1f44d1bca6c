"""Rendered and computed data: sweeps, looks, recordings, scenes."""
