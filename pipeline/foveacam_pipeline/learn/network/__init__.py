"""The foveated stereo network of Sec. 5: encoder, row attention, signed correlation, refinement."""
