"""`foveacam record` and `foveacam recording`: make a recording, say what one holds, make a film of it."""
