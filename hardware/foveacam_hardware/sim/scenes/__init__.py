"""Scenes as files, and the reader of their format."""
