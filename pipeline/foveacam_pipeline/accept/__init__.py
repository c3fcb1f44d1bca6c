"""Acceptance: a guided run that measures what a rig really is, and names what is wrong with it."""
