"""Recordings: tapped from the live frames, shown by moments, depth anew, films."""
