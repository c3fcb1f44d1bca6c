"""Tracking of targets: image trackers, a Kalman filter of position and velocity, scheduling of the foveae."""
