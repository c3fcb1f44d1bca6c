"""What the rig records: captures, stills, recordings, mosaics; how long and where they are kept."""
