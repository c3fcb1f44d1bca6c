"""Fixations: both foveae verge on a target; the targets, and the corrections of their answers."""
