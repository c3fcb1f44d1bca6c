"""Captures, recordings, mosaics and wide-baseline references; and the stub devices for them."""
