"""Resources of the REST interface, grouped by use; one package per noun: schema, routes, service."""
