"""Depth, pictures, clouds and meshes of what was fixated."""
