"""Measurements of points, lengths, planes and profiles in the depth of looks."""
