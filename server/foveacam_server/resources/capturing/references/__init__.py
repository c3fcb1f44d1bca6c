"""Reference depth of captures over the rail's long baselines."""
