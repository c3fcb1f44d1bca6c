"""Benches of looking at recordings."""
