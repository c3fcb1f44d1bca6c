"""Recordings of a running server: where they lie, how one is made beside other work, what is shown of it."""
