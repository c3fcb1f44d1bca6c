"""Calibrating a rig step by step: sessions on disk, the steps, their documents. For server and CLI alike."""
