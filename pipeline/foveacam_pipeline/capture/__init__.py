"""Raster plans, datasets and recordings: what a rig takes of a scene, and how it is kept on the disk."""
