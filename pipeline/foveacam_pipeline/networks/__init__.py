"""Stereo networks of anybody as depth backends: an ONNX graph and a card that says how it is fed."""
