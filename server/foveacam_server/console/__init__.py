"""How a browser comes in: pages, their policy, sign-in, access rules, OpenAPI, viser's relay."""
