"""Drivers that play a recording: its frames timed by the clock, its mirrors at the recorded positions."""
