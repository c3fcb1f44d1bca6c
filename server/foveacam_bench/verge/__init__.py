"""Fixations of clicks, and looking around, judged by the simulation's truth."""
