"""Analyses beyond one rig: the planner, the paper's studies, training of stereo networks."""
