"""The console in a browser: pages, a server that says what a test puts into it, its documents."""
