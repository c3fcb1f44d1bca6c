"""Fixations, in which both foveae verge on a target; the stored targets; corrections of their answers."""
