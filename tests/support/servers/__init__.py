"""Servers of tests, what they hold, and clients of them."""
