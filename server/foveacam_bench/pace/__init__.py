"""Parts of `foveacam bench pace`: the time until a person has an answer."""
