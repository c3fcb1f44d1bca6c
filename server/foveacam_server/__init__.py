"""One process that owns the rig and serves it."""

from importlib.metadata import version

__version__ = version("foveacam-duo")
