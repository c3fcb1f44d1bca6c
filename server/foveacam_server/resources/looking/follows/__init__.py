"""Following several targets: both foveae look at them in turn."""
