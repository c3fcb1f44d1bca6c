"""What the operator sees: the page and the viser scene."""
