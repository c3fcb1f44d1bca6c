"""Live views over WebSocket and MJPEG, and what is drawn over them."""
