"""Depth of a target without matches of its own, inferred from measured points around it."""
