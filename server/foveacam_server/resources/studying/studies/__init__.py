"""`foveacam study`: the paper's analyses, with a report."""
