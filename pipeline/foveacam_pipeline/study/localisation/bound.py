"""The Cramér-Rao bound of a disparity: what the noise of the pictures allows on the pixels of a window.

Noise and texture are measured on repeated frames of one view. The unknowns are those of the estimator: shift,
row, both slopes of the disparity, gain and offset of the brightness.
"""

import math

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput

LEAST_FRAMES = 2


def disparity_bound_px(frames: NDArray[np.float64]) -> float:
    """Return the least standard error of the disparity between two pictures of a texture, px.

    `frames`: (k, h, w) repeated windows about the target, k at least 2, with the noise of one picture each;
    infinite where they have no texture across the rows.
    """
    if frames.ndim != 3 or len(frames) < LEAST_FRAMES or min(frames.shape[1:]) < 3:
        raise InvalidInput(
            f"frames of shape {frames.shape}: give {LEAST_FRAMES} or more windows of "
            "one view, at least 3 px wide"
        )
    variance = float(frames.var(axis=0, ddof=1).mean())
    information = _information(frames)
    try:
        inverse = np.linalg.inv(information)
    except np.linalg.LinAlgError:
        return math.inf
    share = float(inverse[0, 0])
    return math.sqrt(2.0 * variance * share) if share > 0.0 else math.inf  # both pictures have the noise


def _information(frames: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (6, 6) products of the derivatives of the brightness by the unknowns, free of noise.

    Products are taken between different frames, whose noises are independent.
    """
    first, second = frames[::2].mean(axis=0), frames[1::2].mean(axis=0)
    one, two = _derivatives(first), _derivatives(second)
    product = one @ two.T
    return np.asarray((product + product.T) / 2.0, dtype=np.float64)


def _derivatives(image: NDArray[np.float64]) -> NDArray[np.float64]:
    across = (image[1:-1, 2:] - image[1:-1, :-2]) / 2.0
    down = (image[2:, 1:-1] - image[:-2, 1:-1]) / 2.0
    level = image[1:-1, 1:-1]
    y, x = np.mgrid[: level.shape[0], : level.shape[1]].astype(np.float64)
    x -= x.mean()
    y -= y.mean()
    rows = (across, down, across * x, across * y, level - level.mean(), np.ones_like(level))
    return np.array([row.ravel() for row in rows])
