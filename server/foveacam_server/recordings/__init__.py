"""Recordings of a running server: the files on the disk, the one being made, and their documents."""
