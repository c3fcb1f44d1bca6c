"""Resources of calibrating the rig: sessions of measurements, calibrations, drift checks."""
