"""Detect the pixels that only the left eye sees, from the left disparity map alone.

Every matched pixel is mapped to the right window; a left pixel is hidden from the right eye if a nearer
surface is mapped to the same column. Holes get the farther of their two neighbours in the row, because it is
the background that is hidden.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.stereo.refine import FloatImage

NEARER_PX = 1.5
"""A surface hides another one if its disparity is larger by this."""


def occluded_pixels(disparity_px: FloatImage) -> NDArray[np.bool_]:
    """Return (h, w) bool for a disparity map (h, w), px, NaN where unknown; computed at half the size."""
    height, width = disparity_px.shape
    hidden = occluded_cells(np.ascontiguousarray(disparity_px[::2, ::2]))
    return np.asarray(
        cv2.resize(hidden, (width, height), interpolation=cv2.INTER_NEAREST), dtype=np.uint8
    ).view(np.bool_)


def occluded_cells(cells_px: FloatImage) -> NDArray[np.uint8]:
    """Return (n, m) 1 or 0 for a disparity map (n, m) of half the size, px of the full size."""
    from foveacam_pipeline.stereo.kernels import mark_hidden  # numba loads when depth is first computed

    hidden = np.empty(cells_px.shape, dtype=np.uint8)
    mark_hidden(cells_px, np.float32(0.5), np.float32(NEARER_PX), hidden)
    return np.asarray(cv2.medianBlur(hidden, 3), dtype=np.uint8)
