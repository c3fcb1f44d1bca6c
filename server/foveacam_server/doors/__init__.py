"""What comes in from outside, bounded: sizes of bodies, times of connections, threads, tokens tried."""
