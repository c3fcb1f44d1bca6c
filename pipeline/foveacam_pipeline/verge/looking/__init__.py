"""Looks of one fixation: steering within its limits, tracking of the target, detection of passers-by."""
