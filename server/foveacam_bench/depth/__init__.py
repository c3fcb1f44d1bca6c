"""Matching, stereo depth and measured lengths, on rendered and on real pairs."""
