"""Where each eye can look."""
