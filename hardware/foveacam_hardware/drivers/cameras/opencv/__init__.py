"""UVC cameras, network streams, video files and image sequences through OpenCV."""
