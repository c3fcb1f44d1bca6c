"""Limits per person of limited resources, and fair queues."""
