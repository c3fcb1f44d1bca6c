"""What HTML reports share: their base template, its style, and macros."""
