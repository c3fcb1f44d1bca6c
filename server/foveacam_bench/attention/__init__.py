"""Attention: time until a field is known, by the policy and by others; what a decision takes."""
