"""What turns or shifts the whole rig: pan-tilts and rails, by board, by unit or by hand."""
