"""Recordings of live frames: make, list, play, recompute depth, export films."""
