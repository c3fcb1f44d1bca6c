"""All foveae of a scan as one picture of the field of regard, its depth, its points: see `build`."""
