"""`foveacam doctor`: checks what a rig and a server need on this machine."""
