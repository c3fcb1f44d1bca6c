"""Computations of requests: a fair queue, and child processes with limits."""
