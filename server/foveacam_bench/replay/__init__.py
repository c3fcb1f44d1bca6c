"""Benches of the player of recordings."""
