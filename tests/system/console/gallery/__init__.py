"""Tests of the gallery's pages, in a browser."""
