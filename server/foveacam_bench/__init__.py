"""The measured figures of the project, each a command that prints one JSON object; not part of the wheel."""
