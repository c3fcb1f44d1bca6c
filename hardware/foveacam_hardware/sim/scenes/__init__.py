"""Scene files, their format, and their conversion for the renderer."""
