"""Datasets and recordings in an archive on S3-compatible storage."""
