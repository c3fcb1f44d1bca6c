"""Monitoring of the server: timings, flows between its parts, log lines with ids, traces."""
