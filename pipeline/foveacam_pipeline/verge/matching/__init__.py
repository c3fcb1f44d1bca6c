"""Image operations and matches of a fixation: foveae against the wide view, and left against right."""
