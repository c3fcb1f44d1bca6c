"""`foveacam capture`: a raster capture from the command line."""
