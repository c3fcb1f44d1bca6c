"""Computations that a request waits for: their turns, and processes with limits."""
