"""Depth error of foveated stereo (Sec. 4.1), and the trade-off under equal bandwidth (Sec. 4.2)."""
