"""Acceptance: what a stranger brings to the product works, or is refused for the right reason."""
