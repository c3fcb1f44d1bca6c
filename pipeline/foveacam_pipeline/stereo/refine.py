"""The sub-pixel remainder of a disparity map, and each pixel's matching error.

One Gauss-Newton step of the brightness difference over a small window, after taking out its mean (the two
cameras differ in gain). The same sums give the error: residual noise over gradient energy.
"""

from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

FloatImage: TypeAlias = NDArray[np.float32]
"""(h, w) float32."""

SAMPLES = 36
"""Pixels in the window of one estimate: 6 x 6."""
PRE_SIGMA_PX = 0.8
"""Both images are smoothed this much, so that interpolating one of them does not bias the step."""
SLOPE = np.array([[1.0, -8.0, 0.0, 8.0, -1.0]], dtype=np.float32) / 12.0
"""Derivative along x, right to fourth order."""
LARGEST_STEP_PX = 0.75
"""A remainder beyond this contradicts the whole disparity; it is not applied, and counts as error."""
FLOOR_SIGMA_PX = 0.06
"""Interpolation and rectification leave this much however good the texture (deduced from rendered pairs)."""
CORRELATION = 2.0
"""Blur ties neighbouring pixels together: a window holds fewer samples than pixels, by this squared."""
LEAST_NOISE = 0.5
"""Least brightness noise assumed, grey levels: quantisation alone is 0.3 in each image."""
LEAST_ENERGY = 1e-4


def refine(
    left: NDArray[np.uint8],
    right: NDArray[np.uint8],
    sixteenths: NDArray[np.int16],
    valid_right: NDArray[np.bool_],
) -> tuple[FloatImage, FloatImage, NDArray[np.bool_]]:
    """Return (residual px, sigma px, seen in the right window), each (h, w), for a map in 1/16 px."""
    height, width = left.shape
    residual = sixteenths.astype(np.float32)
    residual *= np.float32(1.0 / 16.0)
    columns = np.arange(width, dtype=np.float32)[None, :] - residual
    rows = np.repeat(np.arange(height, dtype=np.float32)[:, None], width, axis=1)
    matched = cv2.remap(right, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    seen = cv2.remap(valid_right.view(np.uint8), columns, rows, cv2.INTER_NEAREST)
    step, sigma = _gauss_newton(left, np.asarray(matched, dtype=np.uint8))
    size = np.abs(step)
    wild = size > np.float32(LARGEST_STEP_PX)
    np.maximum(sigma, size, out=sigma, where=wild)
    step[wild] = 0.0
    residual += step
    return residual, sigma, np.asarray(seen, dtype=np.bool_)


def _gauss_newton(left: NDArray[np.uint8], matched: NDArray[np.uint8]) -> tuple[FloatImage, FloatImage]:
    """Return the step in disparity and its standard error, px, (h, w) float32.

    left = matched - slope * step, in the least squares over each window, brightness offset free. Gradient
    energy is the product of both images' slopes: what noise adds to either cancels, and where nothing is left
    there is no texture. Done in place: at these sizes fresh arrays cost more than the arithmetic.
    """
    difference = _float(cv2.subtract(left, matched, dtype=cv2.CV_32F))
    cv2.GaussianBlur(difference, (3, 3), PRE_SIGMA_PX, dst=difference)
    slope, other = (
        _float(cv2.filter2D(cv2.GaussianBlur(image, (3, 3), PRE_SIGMA_PX), cv2.CV_32F, SLOPE))
        for image in (left, matched)
    )
    energy = _mean(slope * other)
    slope += other
    slope *= np.float32(0.5)
    mean_slope, mean_difference = _mean(slope), _mean(difference)
    step = _mean(slope * difference)
    step -= mean_slope * mean_difference
    variance = _mean(difference * difference)
    mean_difference *= mean_difference
    variance -= mean_difference
    mean_slope *= mean_slope
    energy -= mean_slope
    np.maximum(energy, np.float32(LEAST_ENERGY), out=energy)
    np.maximum(variance, np.float32(LEAST_NOISE**2), out=variance)
    step /= energy
    np.negative(step, out=step)
    variance /= energy
    variance *= np.float32(CORRELATION**2 / SAMPLES)
    variance += np.float32(FLOOR_SIGMA_PX**2)
    size = (left.shape[1], left.shape[0])
    return _float(cv2.resize(step, size)), _float(cv2.resize(np.sqrt(variance), size))


def _mean(image: FloatImage) -> FloatImage:
    """Return the mean over each window, on a grid of half the size: 2 x 2 pixels, then 3 x 3 of those."""
    size = ((image.shape[1] + 1) // 2, (image.shape[0] + 1) // 2)
    return _float(cv2.blur(cv2.resize(image, size, interpolation=cv2.INTER_AREA), (3, 3)))


def _float(image: object) -> FloatImage:
    return np.asarray(image, dtype=np.float32)
