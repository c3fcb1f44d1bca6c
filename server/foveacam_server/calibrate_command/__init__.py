"""`foveacam calibrate`: its commands, the options they share, and the rig and session they work with."""
