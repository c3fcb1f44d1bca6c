"""Fixate a target: point both foveae at it and measure its distance (Sec. 3.4)."""
