"""Limits of what a client may use: sizes of bodies, times of connections, threads, wrong tokens."""
