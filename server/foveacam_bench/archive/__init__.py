"""Figures of the archive: uploads that are cut, reading in place, rates beside a plain upload."""
