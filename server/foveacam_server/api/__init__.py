"""REST: the schemas and one router a resource."""
