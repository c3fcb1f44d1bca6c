"""What HTML reports share: their markup and style."""
