"""Captures, recordings and stills in an archive on S3-compatible storage."""
