"""`foveacam still`: take a still with the command's own rig or on a running server."""
