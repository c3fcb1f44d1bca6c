"""Device drivers, wire protocols and the simulated rig: volts, pixels, bytes and ns; no gaze, no HTTP."""
