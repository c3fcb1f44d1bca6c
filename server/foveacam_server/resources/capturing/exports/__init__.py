"""Exports of captures for other programs, each packed as one ZIP file."""
