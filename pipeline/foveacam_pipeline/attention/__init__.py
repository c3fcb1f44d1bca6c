"""Attention: where the foveae look next, and why."""
