"""References: depth of captures over the rail's long baselines, to evaluate the rig's own depth."""
