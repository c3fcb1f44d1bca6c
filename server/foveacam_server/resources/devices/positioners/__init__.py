"""Pan-tilt and rail: status, moves, hold, and the confirmation of their zero."""
