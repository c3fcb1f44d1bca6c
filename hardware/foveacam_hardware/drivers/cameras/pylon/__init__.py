"""Basler cameras through the vendor's pylon library (the extra `pylon`)."""
