"""Datasets on the disk: what captures, stills, mosaics and references share."""
