"""Resources of the REST interface, one package a noun: schema, routes, service."""
