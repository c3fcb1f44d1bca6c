"""`foveacam doctor`: checks the requirements of a rig and a server on this machine."""
