"""Raster captures: plan, run as jobs, list, draw, download; commands on datasets."""
