"""`foveacam record` and `foveacam recording`: make a recording, describe one, make a film of it."""
