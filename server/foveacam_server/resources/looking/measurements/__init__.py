"""Measurements: points, lengths, planes and profiles in what the foveae have looked at."""
