"""Training a stereo network on what the rig captured."""
