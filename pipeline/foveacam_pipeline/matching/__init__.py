"""Sub-pixel matching: find a point of one picture in another, with a trustworthy standard error."""
