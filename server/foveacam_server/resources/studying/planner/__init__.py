"""The planner: where a target can be seen from, and how well."""
