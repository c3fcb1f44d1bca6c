"""What only the left eye sees, from the left disparity map alone.

Every matched pixel is carried to the right window; a left pixel is hidden from the right eye where a nearer
surface arrives at its place. Holes are given the farther of their two neighbours in the row, for it is the
background that is hidden.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.stereo.refine import FloatImage

NEARER_PX = 1.5
"""A surface whose disparity is larger by this hides what lies behind it."""
_FAR_PX = np.float32(-1e6)


def occluded_pixels(disparity_px: FloatImage) -> NDArray[np.bool_]:
    """Return (h, w) bool for a disparity map (h, w), px, NaN where unknown; worked out at half the size."""
    height, width = disparity_px.shape
    small = np.ascontiguousarray(disparity_px[::2, ::2])
    known = np.isfinite(small)
    guess = _with_background(small, known)
    columns = np.arange(small.shape[1], dtype=np.float32)[None, :]
    place = np.rint(columns - np.float32(0.5) * guess).astype(np.intp)
    inside = (place >= 0) & (place < small.shape[1]) & (guess > _FAR_PX)
    flat = np.arange(small.shape[0])[:, None] * small.shape[1] + np.where(inside, place, 0)
    nearest = np.full(small.size, _FAR_PX, dtype=np.float32)
    carried = inside & known
    np.maximum.at(nearest, flat[carried], small[carried])
    closed = cv2.morphologyEx(nearest.reshape(small.shape), cv2.MORPH_CLOSE, np.ones((1, 3), dtype=np.uint8))
    hidden = inside & (np.asarray(closed).ravel()[flat] > guess + np.float32(NEARER_PX))
    cleaned = cv2.medianBlur(hidden.astype(np.uint8), 3)
    return np.asarray(
        cv2.resize(cleaned, (width, height), interpolation=cv2.INTER_NEAREST), dtype=np.uint8
    ).astype(np.bool_)


def _with_background(disparity_px: FloatImage, known: NDArray[np.bool_]) -> FloatImage:
    """Return the map with holes at the smaller of the nearest known disparities left and right."""
    values = np.where(known, disparity_px, _FAR_PX)
    columns = np.arange(disparity_px.shape[1])[None, :]
    before = np.maximum.accumulate(np.where(known, columns, 0), axis=1)
    after = np.minimum.accumulate(np.where(known, columns, columns.max())[:, ::-1], axis=1)[:, ::-1]
    left = np.take_along_axis(values, before, axis=1)
    right = np.take_along_axis(values, after, axis=1)
    only_one = np.minimum(left, right) <= _FAR_PX
    filled = np.where(only_one, np.maximum(left, right), np.minimum(left, right))
    return np.asarray(np.where(known, disparity_px, filled), dtype=np.float32)
