"""The Cramér-Rao bound of a disparity: what the noise of the pictures allows on the pixels of a window.

Noise and texture are measured on repeated frames of one view. The unknowns are those of the estimator: shift,
row, both slopes of the disparity (with its prior), gain and offset of the brightness.
"""

import math

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.matching.picture import doubled
from foveacam_pipeline.study.localisation.estimator import PRIOR

LEAST_FRAMES = 2
SHIFT, SLOPES = 0, (2, 3)
"""Indices of the shift and of both slopes among the unknowns."""


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
    variance = 2.0 * float(frames.var(axis=0, ddof=1).mean())  # both pictures have the noise
    information = _products(frames)
    for slope in SLOPES:
        information[slope, slope] += variance / PRIOR.slope_sigma**2
    try:
        share = float(np.linalg.inv(information)[SHIFT, SHIFT])
    except np.linalg.LinAlgError:
        return math.inf
    return math.sqrt(variance * share) if share > 0.0 else math.inf


def _products(frames: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (6, 6) products of the derivatives of the brightness by the unknowns, free of noise.

    Products are taken between different frames, whose noises are independent.
    """
    first, second = frames[::2].mean(axis=0), frames[1::2].mean(axis=0)
    product = _derivatives(first) @ _derivatives(second).T
    return np.asarray((product + product.T) / 2.0, dtype=np.float64)


def _derivatives(image: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (6, n): the derivative of each pixel by each unknown.

    Differences are taken half a pixel to either side, as whole pixels miss the finest texture.
    """
    double = doubled(image.astype(np.float32)).astype(np.float64)
    across = double[2:-2:2, 3:-1:2] - double[2:-2:2, 1:-3:2]
    down = double[3:-1:2, 2:-2:2] - double[1:-3:2, 2:-2:2]
    level = image[1:-1, 1:-1]
    y, x = np.mgrid[: level.shape[0], : level.shape[1]].astype(np.float64)
    x -= x.mean()
    y -= y.mean()
    rows = (across, down, across * x, across * y, level - level.mean(), np.ones_like(level))
    return np.array([row.ravel() for row in rows])
