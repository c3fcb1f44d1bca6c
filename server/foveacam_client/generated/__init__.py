"""Written from the OpenAPI document by .ci/generate_client.py: models and operations."""
