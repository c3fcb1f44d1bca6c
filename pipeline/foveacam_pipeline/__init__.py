"""What the numbers mean: angles, models, depth. No driver, no HTTP."""
