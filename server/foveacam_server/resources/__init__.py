"""The REST resources, one folder each: schema, routes, service."""
