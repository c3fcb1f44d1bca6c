"""Datasets on the disk: shared parts of captures, stills, mosaics and references."""
