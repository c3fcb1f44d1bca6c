"""Tests of the pages about the rig, in a browser."""
