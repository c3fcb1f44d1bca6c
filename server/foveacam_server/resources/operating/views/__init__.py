"""Live views over WebSocket and MJPEG, and their overlays."""
