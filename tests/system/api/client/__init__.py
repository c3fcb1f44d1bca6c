"""Tests of the Python client on a server."""
