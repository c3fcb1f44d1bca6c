"""Products of many datasets at once: the commands, and the jobs of the console."""
