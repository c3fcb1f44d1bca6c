"""Opens all services of a running server in order; nothing but the application imports it."""
