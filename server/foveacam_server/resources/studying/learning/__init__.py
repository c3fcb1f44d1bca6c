"""Training of stereo networks on captured or simulated pairs."""
