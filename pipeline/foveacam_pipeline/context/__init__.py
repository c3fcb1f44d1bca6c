"""The wide context: a coarse, persistent depth of the whole wide view, in the rig frame."""
