"""Where a point of one picture is in another, to a fraction of a pixel, with an error that can be trusted."""
