"""Stage 2, measurement: markers, and the sweep that centres them in both foveae."""
