"""Browser access: pages and their policy, sign-in, access rules, OpenAPI, relay of the 3D pane."""
