"""Self-supervised stereo, and datasets for PyTorch. The only importer of torch: the extra `learn`."""
