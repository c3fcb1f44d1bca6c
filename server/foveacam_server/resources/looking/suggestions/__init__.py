"""Suggestions of good targets in the live wide picture."""
