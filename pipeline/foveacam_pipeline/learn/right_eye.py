"""The truth of the right eye, from that of the left one."""

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.learn.pair_folder import PairTruth


def right_truth(
    truth: PairTruth, window: tuple[slice, slice]
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Return the disparity of a window of the right picture, float32, px, and where it is known, both (h, w).

    What both eyes see is drawn at its column of the right picture, rounded; of several that fall on one pixel
    the nearest is kept. A pixel that none falls on is unknown, and has 0.
    """
    rows, columns = window
    seen = truth.both[rows] & np.isfinite(truth.disparity_px[rows])
    height, width = seen.shape
    drawn_px = np.full((height, width), -np.inf, np.float32)
    y, x = np.nonzero(seen)
    disparity_px = truth.disparity_px[rows][y, x]
    x_right = np.rint(x - disparity_px).astype(np.intp)
    inside = (x_right >= 0) & (x_right < width)
    np.maximum.at(drawn_px, (y[inside], x_right[inside]), disparity_px[inside])
    known = np.isfinite(drawn_px)
    return np.where(known, drawn_px, np.float32(0.0))[:, columns], known[:, columns]
