"""Faults and warnings of the running server, as a list that shows which are still present."""
