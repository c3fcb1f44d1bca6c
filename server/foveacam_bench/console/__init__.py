"""The console in a browser: STOP, accessibility, first load, the 3D pane, response times, notebooks."""
