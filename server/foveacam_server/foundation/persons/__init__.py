"""What one person may hold of limited things, and whose turn is next."""
