"""Opens all services of a running server in order; imported by the application only."""
