"""`foveacam dataset`: commands for datasets on the disk; they need no rig and run beside a server."""
