"""From a click to both foveae on one point, and its distance (Sec. 3.4)."""
