"""What becomes of a calibration in the field: drift checks and health."""
