"""Stills: stacks of frames at the mirrors' present pose, held until they are kept or discarded."""
