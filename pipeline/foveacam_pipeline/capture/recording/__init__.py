"""Recordings (.fcap, an MCAP file): written at full rate, read by time and stream, recovered when cut off."""
