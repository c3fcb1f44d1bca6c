"""Faults and warnings of the running server, as a list that says which are still present."""
