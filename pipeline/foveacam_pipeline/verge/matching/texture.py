"""Brightness noise of an image, and the matching error that it causes."""

import cv2
import numpy as np
from numpy.typing import NDArray

BLOCK = 16
QUIET_SHARE = 0.1
"""Quantile of the blocks that shows the noise; blocks above it hold texture as well."""
LAPLACIAN = np.array([[1.0, -2.0, 1.0], [-2.0, 4.0, -2.0], [1.0, -2.0, 1.0]], dtype=np.float32)
LAPLACIAN_GAIN = 36.0
"""Sum of its squared weights: variance of its response to white noise of variance 1."""
LEAST_VARIANCE = 1.0 / 12.0
"""Variance of rounding to whole grey levels."""


def noise_level(gray: NDArray[np.uint8], *, at_px: NDArray[np.float64]) -> float:
    """Return the standard deviation of the brightness noise about a point, (2,) px, grey levels."""
    return noise_about(gray, noise_slope(gray), at_px=at_px)


def noise_slope(gray: NDArray[np.uint8]) -> float:
    """Return the variance of an image's noise per grey level of brightness.

    Shot noise grows with brightness, so every block contributes its variance over its mean; the quietest
    blocks are those without texture.
    """
    small = gray[::2] if gray.size > 500_000 else gray
    rough = cv2.filter2D(small, cv2.CV_32F, LAPLACIAN)
    height, width = (side // BLOCK * BLOCK for side in small.shape)
    size = (width // BLOCK, height // BLOCK)
    variance = cv2.resize(cv2.multiply(rough, rough)[:height, :width], size, interpolation=cv2.INTER_AREA)
    mean = cv2.resize(small[:height, :width], size, interpolation=cv2.INTER_AREA).astype(np.float32)
    lit = (mean > 8.0) & (mean < 245.0)
    if not lit.any():
        return 0.0
    per_level = (variance[lit] / LAPLACIAN_GAIN - LEAST_VARIANCE) / mean[lit]
    return max(0.0, float(np.quantile(per_level, QUIET_SHARE)))


def noise_about(gray: NDArray[np.uint8], slope: float, *, at_px: NDArray[np.float64]) -> float:
    """Return `noise_level` for a known `noise_slope`."""
    x, y = (
        int(np.clip(round(float(v)), 0, side - 1)) for v, side in zip(at_px, gray.shape[::-1], strict=True)
    )
    around = gray[max(0, y - BLOCK) : y + BLOCK + 1, max(0, x - BLOCK) : x + BLOCK + 1]
    return float(np.sqrt(LEAST_VARIANCE + slope * float(around.mean())))


def shift_sigma(patch: NDArray[np.float32], *, noise: float, enlarged: float) -> float:
    """Return the standard error of a patch's place along x due to noise, px of the image it was cut from.

    `noise`: grey levels in that image. `enlarged`: samples of the patch per px. The patch is smoothed by one
    px first; 1.5 times the gradient energy of noise is subtracted: bare noise gives infinity.
    """
    smooth = cv2.GaussianBlur(patch, (0, 0), enlarged)
    slope = (smooth[:, 2:] - smooth[:, :-2]) / 2.0
    slope = slope - float(slope.mean())  # shading is not texture
    own = slope.size / enlarged**2 * noise**2 / (8.0 * np.pi)
    energy = float(np.sum(slope * slope)) - 1.5 * own
    return noise / float(np.sqrt(energy)) if energy > 0.0 else float("inf")
