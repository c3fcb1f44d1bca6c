"""Dense stereo of a fovea pair: rectification, disparity, depth with its error, clouds and meshes."""
