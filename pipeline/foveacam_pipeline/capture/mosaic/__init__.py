"""Mosaics: all foveae of a scan as one picture of the field of regard, with its depth. Start at `build`."""
