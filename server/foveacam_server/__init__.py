"""The server: one process that owns the rig and offers it by REST, WebSocket and a browser console."""

from importlib.metadata import version

__version__ = version("foveacam-duo")
