"""Captures, stills, mosaics and references on the disk, for server and command line."""
