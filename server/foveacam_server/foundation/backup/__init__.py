"""Backups of a data directory: made while a server uses it, restored completely or not at all."""
