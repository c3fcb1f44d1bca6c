"""Mirrors: where they point, and steering them by hand."""
