"""The wide context: a coarse depth map of the whole wide view, kept and updated between fixations."""
