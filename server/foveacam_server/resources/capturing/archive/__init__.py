"""The archive: copies of captures, recordings and stills on S3-compatible storage."""
