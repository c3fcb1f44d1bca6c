"""Resources of recorded data: captures, stills, recordings, mosaics, references, archive, retention."""
