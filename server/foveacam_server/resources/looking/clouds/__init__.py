"""Depth maps, pictures, point clouds and meshes of fixations."""
