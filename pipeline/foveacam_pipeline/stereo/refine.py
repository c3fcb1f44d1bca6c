"""Refine a disparity map to sub-pixel precision by one Gauss-Newton step.

The step minimises the brightness difference over a small window after its mean is removed (the two cameras
differ in gain). `errors` uses the noise and the gradient energy of each window.
"""

from dataclasses import dataclass
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
"""A larger step contradicts the whole-pixel disparity; it is not applied and counts as an error."""
PRIOR_SIGMA_PX = 0.4
"""Assumed error of the disparity before refinement: with little texture the step is shortened. The median
errors of the fitting data (see `errors`) change by 10 % between 0.3 and 0.6."""
CORRELATION = 2.0
"""Blur correlates neighbouring pixels: the samples of a window are its pixels over the square of this."""
LEAST_NOISE = 0.5
"""Least brightness noise assumed, grey levels: quantisation alone is 0.3 in each image."""
LEAST_ENERGY = 1e-4
WIDE_CELLS = 13
"""Side of the larger window in which gradients are compared, cells of 2 x 2 pixels."""

LEAST_LIKENESS = 0.1
"""Least correlation of the gradients of both windows about a pixel; below it only noise was compared. Of the
rendered fitting data, 69 % of the wrong matches on blank surfaces lie below it, 2.7 % of the right ones."""

CLEAR_LIKENESS, LEAST_LOCAL_LIKENESS = 0.25, 0.4
"""Where gradients correlate by less than the first about a pixel, they must correlate by the second at it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Refinement:
    """A refined disparity map, and what was measured about it on cells (n, m).

    `residual_px`, `seen`: of the map's size. The others: of cells of 2 x 2 pixels, or of the map's size where
    it is a map of cells.
    """

    residual_px: FloatImage
    step_px: FloatImage
    """The step before it is limited and shortened."""
    noise: FloatImage
    """Standard deviation of the brightness difference in the window, grey levels, at least `LEAST_NOISE`."""
    noise_sigma_px: FloatImage
    """Standard error of the step from noise and gradient energy alone."""
    likeness: FloatImage
    """Correlation of the gradients of both windows, -1 to 1; near 0 where only noise is compared."""
    wide_likeness: FloatImage
    """The same over `WIDE_CELLS` windows, which separates texture from noise where one window cannot."""
    seen: NDArray[np.bool_]
    """Whether the matched pixel lies in the valid part of the right window."""


def refine(
    left: NDArray[np.uint8],
    right: NDArray[np.uint8],
    disparity_px: FloatImage,
    valid_right: NDArray[np.bool_],
) -> Refinement:
    """Refine a finite disparity map (h, w), px, of two grey images (h, w); rows and columns may be odd."""
    places = _places_at_right(disparity_px)
    matched = cv2.remap(right, *places, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    sums = _gauss_newton(left, np.asarray(matched, dtype=np.uint8))
    step, variance = sums.step_px, sums.variance
    step_variance = variance / np.maximum(sums.energy, np.float32(LEAST_ENERGY))
    step_variance *= np.float32(CORRELATION**2 / SAMPLES)
    applied = step / (1.0 + step_variance / np.float32(PRIOR_SIGMA_PX**2))
    applied[np.abs(step) > np.float32(LARGEST_STEP_PX)] = 0.0
    likeness, wide_likeness = energy_ratios(sums.energy, sums.own_energy)
    residual = _float(cv2.resize(applied, left.shape[::-1]))
    residual += disparity_px
    return Refinement(
        residual_px=residual,
        step_px=step,
        noise=np.sqrt(variance),
        noise_sigma_px=np.sqrt(step_variance),
        likeness=likeness,
        wide_likeness=wide_likeness,
        seen=_seen_at(places, valid_right),
    )


def seen_at_right(disparity_px: FloatImage, valid_right: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return (h, w) bool: whether a finite disparity map, px, leads to a valid part of the right window."""
    return _seen_at(_places_at_right(disparity_px), valid_right)


def _places_at_right(disparity_px: FloatImage) -> tuple[FloatImage, FloatImage]:
    """Return columns and rows, px, of the right window that show what each left pixel shows."""
    height, width = disparity_px.shape
    columns = np.arange(width, dtype=np.float32)[None, :] - disparity_px
    return columns, np.repeat(np.arange(height, dtype=np.float32)[:, None], width, axis=1)


def _seen_at(places: tuple[FloatImage, FloatImage], valid_right: NDArray[np.bool_]) -> NDArray[np.bool_]:
    seen = cv2.remap(valid_right.view(np.uint8), *places, cv2.INTER_NEAREST)
    return np.asarray(seen, dtype=np.bool_)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Sums:
    """The sums over the windows, on a grid of half the size."""

    step_px: FloatImage
    variance: FloatImage
    """Of the brightness difference, grey levels squared."""
    energy: FloatImage
    """Mean product of both images' slopes, may be negative."""
    own_energy: FloatImage
    """Mean of both images' squared slopes."""


def _gauss_newton(left: NDArray[np.uint8], matched: NDArray[np.uint8]) -> _Sums:
    """Return the sums of one step, images (h, w).

    left = matched - slope * step, by least squares over each window with a free brightness offset. Gradient
    energy is the mean product of both images' slopes, in which independent noise cancels; without texture it
    is about zero. Arrays are reused because allocating them costs more than the arithmetic.
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
    own_energy = _mean(slope * slope)
    mean_slope, mean_difference = _mean(slope), _mean(difference)
    step = _mean(slope * difference)
    step -= mean_slope * mean_difference
    variance = _mean(difference * difference)
    mean_difference *= mean_difference
    variance -= mean_difference
    mean_slope *= mean_slope
    energy -= mean_slope
    own_energy -= mean_slope
    own_energy *= np.float32(2.0)
    own_energy -= energy
    np.maximum(variance, np.float32(LEAST_NOISE**2), out=variance)
    step /= np.maximum(energy, np.float32(LEAST_ENERGY))
    np.negative(step, out=step)
    return _Sums(step_px=step, variance=variance, energy=energy, own_energy=own_energy)


def energy_ratios(energy: FloatImage, own_energy: FloatImage) -> tuple[FloatImage, FloatImage]:
    """Return the correlation of both windows' gradients at every cell and over its surroundings, (n, m)."""
    return _ratio(energy, own_energy), _ratio(_wide(energy), _wide(own_energy))


def gradients_correlate(refinement: Refinement) -> NDArray[np.bool_]:
    """Return (n, m) bool: where the gradients of both windows correlate more than those of noise."""
    return (refinement.wide_likeness >= np.float32(LEAST_LIKENESS)) & (
        (refinement.wide_likeness >= np.float32(CLEAR_LIKENESS))
        | (refinement.likeness >= np.float32(LEAST_LOCAL_LIKENESS))
    )


def _ratio(energy: FloatImage, own_energy: FloatImage) -> FloatImage:
    ratio = np.maximum(own_energy, np.float32(LEAST_ENERGY))
    np.divide(energy, ratio, out=ratio)
    return np.clip(ratio, np.float32(-1.0), np.float32(1.0), out=ratio)


def _wide(image: FloatImage) -> FloatImage:
    return _float(cv2.blur(image, (WIDE_CELLS, WIDE_CELLS)))


def _mean(image: FloatImage) -> FloatImage:
    """Return the mean over each window, on a grid of half the size: 2 x 2 pixels, then 3 x 3 of those."""
    size = ((image.shape[1] + 1) // 2, (image.shape[0] + 1) // 2)
    return _float(cv2.blur(cv2.resize(image, size, interpolation=cv2.INTER_AREA), (3, 3)))


def _float(image: object) -> FloatImage:
    return np.asarray(image, dtype=np.float32)
