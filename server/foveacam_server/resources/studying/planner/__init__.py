"""The planner: where an observer can stand to see a target, and the probability of success."""
