"""The looks of one fixation: steering within its limits, the track of the target, and passers-by."""
