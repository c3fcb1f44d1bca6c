"""Who may do what: every route by every role, and credentials that must not be accepted (`bench auth`)."""
