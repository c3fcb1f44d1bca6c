"""Mirrors: their directions, their controller, and steering by hand."""
