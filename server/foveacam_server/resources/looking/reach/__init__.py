"""The reach of each eye: its calibrated field in the wide image."""
