"""Users' stereo networks as depth backends: an ONNX graph, and a card that describes inputs and output."""
