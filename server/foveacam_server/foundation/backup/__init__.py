"""Backups of a data directory: made while a server uses it, restored whole or not at all."""
