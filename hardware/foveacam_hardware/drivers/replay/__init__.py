"""A recording in the place of the devices: its frames on the clock, its mirrors where they were recorded."""
