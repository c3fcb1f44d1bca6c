"""Resources of recorded data: captures, stills, recordings, products, archive, retention."""
