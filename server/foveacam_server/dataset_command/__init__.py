"""`foveacam dataset`: check, info, export, rectify and pictures of datasets on the disk; no rig is needed."""
