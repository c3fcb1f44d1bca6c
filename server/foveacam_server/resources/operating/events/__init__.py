"""The event log over REST and as a stream."""
