"""Inverse of OpenCV's lens distortion, where it has one.

The radius in the image grows with the angle from the axis only up to some angle: beyond it the fitted
polynomial folds back, and part of the image may not be reached at all.
"""

from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

WIDEST_TAN = 10.0
"""Tangent of the largest angle from the axis that is considered, 84 degrees."""
RADII = 4001
NUMERATOR, DENOMINATOR = (0, 1, 4), (5, 6, 7)
"""Places of k1 to k3 and of k4 to k6 in OpenCV's order."""
EXACT_PX = 1e-4
"""Largest error of a direction that counts as the inverse, px of the image."""
ROUNDS, CONVERGED_PX = 1000, 1e-9
"""Of OpenCV's iteration, which is slow where the distortion is strong: after a hundred, 0.6 % of an image
that the lens reaches everywhere was still missing."""
NOTHING = np.zeros(3)


@cache
def largest_radius(distortion: tuple[float, ...]) -> float:
    """Return the tangent of the angle from the axis up to which the radius in the image grows."""
    radius = np.linspace(0.0, WIDEST_TAN, RADII)
    grows = np.diff(_distorted(radius, distortion)) > 0.0
    return float(radius[np.argmin(grows)]) if not grows.all() else WIDEST_TAN


def forward(
    tangents: NDArray[np.float64],
    matrix: NDArray[np.float64],
    distortion: tuple[float, ...],
    *,
    widest: float,
) -> NDArray[np.float64]:
    """Return (n, 2) pixels of (n, 2) tangents; NaN beyond the radius `widest`, at most `largest_radius`."""
    pixels = _projected(tangents, matrix, distortion)
    pixels[np.hypot(*tangents.T) > widest] = np.nan
    return pixels


def inverse(
    pixels: NDArray[np.float64],
    matrix: NDArray[np.float64],
    distortion: tuple[float, ...],
    *,
    widest: float,
) -> NDArray[np.float64]:
    """Return (n, 2) tangents of (n, 2) pixels, exact to `EXACT_PX`; NaN where no direction reaches.

    `widest`: as for `forward`.
    """
    stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, ROUNDS, CONVERGED_PX)
    found = cv2.undistortPoints(pixels[:, None, :], matrix, np.array(distortion), criteria=stop)
    tangents = np.asarray(found, dtype=np.float64)[:, 0, :]
    with np.errstate(invalid="ignore", over="ignore"):
        off_px = np.abs(_projected(tangents, matrix, distortion) - pixels).max(axis=1)
        reached = (off_px <= EXACT_PX) & (np.hypot(*tangents.T) <= widest)
    tangents[~reached] = np.nan
    return tangents


def _distorted(radius: NDArray[np.float64], distortion: tuple[float, ...]) -> NDArray[np.float64]:
    """Return the radii in the image, in focal lengths; the tangential terms are left out."""
    powers = (radius * radius)[:, None] ** np.arange(1, 4)
    above, below = (
        1.0 + powers @ np.array([distortion[k] if k < len(distortion) else 0.0 for k in places])
        for places in (NUMERATOR, DENOMINATOR)
    )
    return np.asarray(np.where(below > 0.0, radius * above / np.where(below > 0.0, below, 1.0), -1.0))


def _projected(
    tangents: NDArray[np.float64], matrix: NDArray[np.float64], distortion: tuple[float, ...]
) -> NDArray[np.float64]:
    points = np.column_stack([tangents, np.ones(len(tangents))])
    image, _ = cv2.projectPoints(points, NOTHING, NOTHING, matrix, np.array(distortion))
    return np.asarray(image, dtype=np.float64)[:, 0, :]
