"""`foveacam study`: the paper's analyses from the command line, with a report."""
