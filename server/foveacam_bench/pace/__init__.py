"""How fast the server is there, and how fast it answers, on a machine of two cores."""
