"""The server's one rig: hardware thread, status, live views, streams and the stop.

Independent of resources.
"""
