"""Resources of looking: fixations, followed targets, the vergence loop, depth, clouds and measurements."""
