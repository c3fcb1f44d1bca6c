"""Stage 2, measuring: markers, and the sweep that centres them in both foveae."""
