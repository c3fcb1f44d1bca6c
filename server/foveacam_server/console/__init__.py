"""How a browser comes in: pages, their policy, sign-in, hosts and tokens, OpenAPI, viser's relay."""
