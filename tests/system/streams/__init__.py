"""Tests of the streams of a whole server."""
