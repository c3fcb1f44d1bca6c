"""Good targets in what the wide camera sees now."""
