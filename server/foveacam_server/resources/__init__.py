"""Resources of the REST interface, by what a user does; one package a noun: schema, routes, service."""
