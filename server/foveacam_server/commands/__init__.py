"""What several commands of `foveacam` share: options about the rig, and the opening of the rig."""
