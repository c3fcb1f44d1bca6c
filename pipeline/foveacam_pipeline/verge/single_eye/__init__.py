"""The depth of a target from one fovea and the wide camera, when only one eye sees it."""
