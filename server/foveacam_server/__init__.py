"""One process that owns the rig and serves it."""
