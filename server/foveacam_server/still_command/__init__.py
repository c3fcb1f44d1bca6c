"""`foveacam still`: a still from the command line, of a rig opened here or of one that a server has."""
