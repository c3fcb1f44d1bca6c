"""Limits of what a client may use: bodies, times of connections, threads; the stop's own way; TLS."""
