"""The tile rasteriser: radiance, depth and identity of what a camera sees."""
