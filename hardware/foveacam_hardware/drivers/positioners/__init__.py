"""Drivers of pan-tilts and rails: Grbl boards, FLIR pan-tilt units, and manual ones."""
