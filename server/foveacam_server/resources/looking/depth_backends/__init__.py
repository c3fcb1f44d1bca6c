"""Backends that compute the depth of a look: semi-global matching, or a network of one's own."""
