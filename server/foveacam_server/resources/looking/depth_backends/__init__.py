"""Backends that compute the depth of a look: semi-global matching, or a stereo network added by the user."""
