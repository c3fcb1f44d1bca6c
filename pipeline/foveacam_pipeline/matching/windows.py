"""Windows about a point: weights, normalised brightness and gradients."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Binning

Image = NDArray[np.float32]
LEAST_DEVIATION = 1e-3
"""Weighted standard deviation below which a window has no contrast, grey levels."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MatchWindow:
    """Half side of the window, px, and the standard deviation of its Gaussian weights."""

    half_px: int
    weight_sigma_px: float

    def binned(self, binning: Binning) -> "MatchWindow":
        """Return the window size that covers the same part of the scene in a binned picture."""
        return MatchWindow(half_px=self.half_px // binning, weight_sigma_px=self.weight_sigma_px / binning)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WindowWeights:
    """The weights of a window, (n, n) float32 of sum 1; `samples`: their sum before normalisation."""

    weights: Image
    axis: Image
    samples: float

    @property
    def half(self) -> tuple[int, int]:
        """Half sides (x, y), px."""
        side = (len(self.axis) - 1) // 2
        return side, side

    def mean(self, image: Image) -> float:
        """Return the weighted mean."""
        return float(np.vdot(self.weights, image))

    def normalised(self, image: Image) -> Image | None:
        """Return the image with weighted mean 0 and variance 1; None when it has no contrast."""
        centred = image - np.float32(self.mean(image))
        deviation = math.sqrt(max(0.0, self.mean(centred * centred)))
        return centred / np.float32(deviation) if deviation > LEAST_DEVIATION else None

    def slopes(self, image: Image, count: int) -> Image:
        """Return (2 + count, n²): derivatives of the brightness by x, y and `count` slopes of the window."""
        side = len(self.axis)
        columns = np.zeros((2 + count, side, side), dtype=np.float32)
        columns[0, :, 1:-1] = (image[:, 2:] - image[:, :-2]) * np.float32(0.5)
        columns[1, 1:-1, :] = (image[2:, :] - image[:-2, :]) * np.float32(0.5)
        for k in range(count):
            along = self.axis[None, :] if k % 2 == 0 else self.axis[:, None]
            np.multiply(columns[k // 2], along, out=columns[2 + k])
        return columns.reshape(2 + count, -1)


@lru_cache(maxsize=16)
def bell(window: MatchWindow) -> WindowWeights:
    """Return the Gaussian weights of a window."""
    axis = np.arange(-window.half_px, window.half_px + 1, dtype=np.float64)
    side = np.exp(-0.5 * (axis / window.weight_sigma_px) ** 2)
    samples = float(side.sum()) ** 2
    weights = (np.outer(side, side) / samples).astype(np.float32)
    return WindowWeights(weights=weights, axis=axis.astype(np.float32), samples=samples)
