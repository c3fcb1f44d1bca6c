"""What touches the world: volts, pixels, bytes, nanoseconds. Knows no angle and no HTTP."""
