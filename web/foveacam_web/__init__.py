"""The console's static files and the 3D scene, which viser serves."""
