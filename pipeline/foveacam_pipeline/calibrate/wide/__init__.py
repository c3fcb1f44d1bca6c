"""Stage 1: the wide camera, measured with a board that somebody shows it."""
