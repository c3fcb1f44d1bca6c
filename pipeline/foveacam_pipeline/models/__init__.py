"""Calibrated models, frozen, and the versioned file that holds them."""
