"""Cameras behind the contract: one supervisor over the little that each vendor's library can do."""
