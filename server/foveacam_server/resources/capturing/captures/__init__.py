"""Raster captures: planned, run as jobs, found, shown, sent; datasets on the command line."""
