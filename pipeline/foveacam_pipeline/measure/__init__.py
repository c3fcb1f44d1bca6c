"""Measurements in the dense depth of a look: points, lengths, planes and profiles, with standard errors."""
