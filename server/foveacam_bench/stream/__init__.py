"""Live views: the encoder and its clients, and the console in a real browser."""
