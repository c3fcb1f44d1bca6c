"""The control lease over REST."""
