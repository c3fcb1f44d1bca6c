"""The stop over REST, and as HTTP without the event loop."""
