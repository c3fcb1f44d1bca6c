"""Equalise local brightness and contrast, so that a strong edge does not outweigh fine texture."""

import cv2
import numpy as np
from numpy.typing import NDArray

COARSE_SIGMA = 2.5
"""Blurs are computed on a grid so coarse that their standard deviation is this many of its pixels."""


def even(
    image: NDArray[np.float32], *, shading_px: float, contrast_px: float, least: float
) -> NDArray[np.float32]:
    """Return the image minus its blur, divided by its local contrast, (h, w) float32.

    `shading_px`, `contrast_px`: standard deviations of the blur and of the local contrast's window. `least`:
    contrast below this is not amplified, as it may be noise; grey levels.
    """
    detail = cv2.subtract(image, _slow(image, shading_px))
    energy = _slow(np.asarray(cv2.multiply(detail, detail), dtype=np.float32), contrast_px)
    return np.asarray(detail / np.sqrt(energy + np.float32(least**2)), dtype=np.float32)


def _slow(image: NDArray[np.float32], sigma_px: float) -> NDArray[np.float32]:
    """Return the image blurred by `sigma_px`, computed on a coarser grid."""
    height, width = image.shape
    step = max(1, round(sigma_px / COARSE_SIGMA))
    size = (max(1, round(width / step)), max(1, round(height / step)))
    coarse = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    blurred = cv2.GaussianBlur(coarse, (0, 0), sigma_px / step, borderType=cv2.BORDER_REFLECT_101)
    return np.asarray(cv2.resize(blurred, (width, height), interpolation=cv2.INTER_LINEAR), dtype=np.float32)
