"""Following of moving targets."""
