"""HTTP: limits of requests, parts shared by routes, addresses."""
