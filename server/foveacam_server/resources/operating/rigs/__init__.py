"""The rigs of a lab: this one, those that a file names, and those that announce themselves."""
