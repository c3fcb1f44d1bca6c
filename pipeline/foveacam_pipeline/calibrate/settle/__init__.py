"""Settling of the mirrors: how fast each axis comes to rest after a step."""
