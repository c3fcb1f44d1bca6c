"""The device drivers: camera drivers against a bare loop, and the mirror controller's serial link."""
