"""A day of use in virtual time, then many clients at once: whether a server's resources grow."""
