"""Files on disk for the whole pipeline: atomic writes, disk errors, free space."""
