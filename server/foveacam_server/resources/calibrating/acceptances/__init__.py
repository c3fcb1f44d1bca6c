"""Acceptance runs: a rig measures itself on its markers, and a report names what is wrong with it."""
