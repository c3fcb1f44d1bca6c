"""State and health of the rig and of the server."""
