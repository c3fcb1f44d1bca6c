"""The token cost of foveated images (Sec. 4.3)."""
