"""Parts shared by commands of `foveacam` (options, opening the rig); commands of several resources."""
