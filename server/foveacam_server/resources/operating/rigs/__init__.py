"""The rigs of a lab: this one, those listed in a file, and those found in the network by DNS-SD."""
