"""Raster plans, datasets, recordings, stills, mosaics and depth references: making, writing, reading them."""
