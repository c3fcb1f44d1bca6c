"""The report of a calibration: one HTML page, Table 2 as measured."""
