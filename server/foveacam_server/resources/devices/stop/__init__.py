"""The stop: parks the mirrors and refuses all moves until it is released."""
