"""Import of recordings: uploaded by a browser in parts, or opened in a folder of the server's machine."""
