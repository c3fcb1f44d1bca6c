"""From a fovea pair to disparity, depth with its error, clouds and meshes."""
