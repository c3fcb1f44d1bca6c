"""Recordings (.fcap, an MCAP file): written at full rate, read by time and stream, readable when cut off."""
