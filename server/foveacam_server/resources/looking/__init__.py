"""Looking at things: fixations, followed targets, the loop, and what is known of depth and shape."""
