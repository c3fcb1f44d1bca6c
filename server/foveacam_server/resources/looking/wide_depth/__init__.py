"""The wide depth: coarse depth of the whole wide view."""
