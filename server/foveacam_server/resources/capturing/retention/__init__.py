"""Retention: rules by age and size that move captures, recordings and stills to the trash."""
