"""Camera drivers: a supervised camera over a small device interface, implemented per vendor library."""
