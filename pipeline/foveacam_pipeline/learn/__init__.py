"""The only importer of torch (the extra `learn`): datasets for PyTorch, and the timing of attention."""
