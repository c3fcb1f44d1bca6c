"""Stage 1: calibration of the wide camera with views of a board."""
