"""`foveacam doctor`: what a rig and a server would need on this machine, checked one by one."""
