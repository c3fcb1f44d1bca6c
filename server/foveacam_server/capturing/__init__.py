"""Captures for server and command line alike: begun or gone on with, kept on a shelf, estimated, shown."""
