"""Fixations and their targets: both foveae verge on what was clicked."""
