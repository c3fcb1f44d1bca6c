"""What tells how the server works: times of its parts, ids in its log lines, traces."""
