"""The measured figures, each a command that prints one JSON object."""
