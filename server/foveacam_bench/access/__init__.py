"""Access control: every route with every role, and credentials that must be refused (`bench auth`)."""
