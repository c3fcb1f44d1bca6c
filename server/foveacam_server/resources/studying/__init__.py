"""Resources of analyses: the planner, the paper's studies, training of stereo networks."""
