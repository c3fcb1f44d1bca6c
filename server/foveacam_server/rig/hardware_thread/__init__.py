"""The parts of the hardware thread that `rig/hardware.py` is composed of."""
