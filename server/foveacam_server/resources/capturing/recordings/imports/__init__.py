"""Recordings from elsewhere: sent by a browser in parts, or opened in a folder of this machine."""
