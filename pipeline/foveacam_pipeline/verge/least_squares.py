"""The sub-pixel place of a point in one fovea against the other, by weighted Gauss-Newton steps.

Pixels weigh by their nearness to the point, so that they answer for the point and not for its surroundings.
Disparity may slope across the window. Rows are known to match: where the texture cannot tell, they do.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

ROW_SIGMA_PX = 4.0
"""How well the calibration knows that rows match; weighs nothing where there is texture."""
SLOPE_SIGMA = 0.5
"""Slopes of disparity to be expected, px a px; across the rows it is the baseline over the height above a
level surface."""
ROUNDS = 8
LEVEL_ROUNDS = 2
"""The first rounds move the window without sloping it."""
STOP_PX = 0.01
LARGEST_ROUND_PX = 2.0
ELSEWHERE_PX = 10.0
LEAST_LEAD = 0.004
"""By so much, and by twice what noise took from it, a match must beat those so far along the line."""
CORRELATION = 3.0
"""The optics' blur ties neighbouring pixels together (sigma 1.4 px): fewer samples than pixels, squared."""
FLOOR_SIGMA_PX = 0.03
"""Interpolation leaves this much (deduced from rendered pairs)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Window:
    """Half side of the window, fovea px, and the standard deviation of its bell of weights."""

    half_px: int
    weight_sigma_px: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Patch:
    """One eye's surroundings of the point, float32 with odd sides; the point is in the middle."""

    image: NDArray[np.float32]

    def cut(
        self, half_px: tuple[int, int], place: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    ) -> NDArray[np.float32]:
        """Return the window about the point, (2 hy + 1, 2 hx + 1) float32.

        `place`: (x, y) by which it is moved, px, and how much further along x per px along x and along y.
        """
        x, y, along, across = place
        height, width = self.image.shape
        middle_x, middle_y = (width - 1) / 2, (height - 1) / 2
        image_from_window = np.array(
            [
                [1.0 + along, across, middle_x + x - (1.0 + along) * half_px[0] - across * half_px[1]],
                [0.0, 1.0, middle_y + y - half_px[1]],
            ]
        )
        view = cv2.warpAffine(
            self.image,
            image_from_window,
            (2 * half_px[0] + 1, 2 * half_px[1] + 1),
            flags=cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP,
            borderMode=cv2.BORDER_REPLICATE,
        )
        return np.asarray(view, dtype=np.float32)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Placed:
    """Right minus left place, (2,) fovea px; its error along x and y; weighted correlation there.

    `slope`: (2,) how much further right the place is per px along x and along y.
    """

    place_px: NDArray[np.float64]
    slope: NDArray[np.float64]
    sigma_px: tuple[float, float]
    score: float


def least_squares(
    left: Patch,
    right: Patch,
    start: NDArray[np.float64],
    *,
    window: Window,
    told_px: NDArray[np.float64],
) -> Placed:
    """Refine a start: (4,) right minus left x and y, px, and slope of x along x and y.

    `told_px`: (2,) the place at which the rows match.
    """
    half = (window.half_px, window.half_px)
    axis = np.arange(-window.half_px, window.half_px + 1, dtype=np.float64)
    bell = np.exp(-0.5 * (axis / window.weight_sigma_px) ** 2)
    samples = float(bell.sum()) ** 2
    weights = np.outer(bell, bell) / samples
    reference = _normalised(left.cut(half), weights)
    state = start.copy()
    expected = np.array([0.0, float(told_px[1]), 0.0, 0.0])
    fit: _Fit | None = None
    for count in range(ROUNDS):
        x, y, along, across = state.tolist()
        moved = _normalised(right.cut(half, (x, y, along, across)), weights)
        if reference is None or moved is None:
            break
        fit = _Fit.of(reference, moved, weights, samples)
        normal, side = fit.equations(axis, expected - state)
        free = slice(0, 2 if count < LEVEL_ROUNDS else 4)
        if not np.linalg.det(normal[free, free]) > 0.0:
            break
        step = np.linalg.solve(normal[free, free], side[free])
        largest_px = float(np.abs(step[:2]).max())
        if largest_px > LARGEST_ROUND_PX:
            break
        state[free] += step
        if count >= LEVEL_ROUNDS and largest_px < STOP_PX:
            break
    if fit is None or reference is None:
        return Placed(place_px=state[:2], slope=state[2:], sigma_px=(math.inf, math.inf), score=0.0)
    sigma_x_px, sigma_y_px = fit.errors_px(axis)
    if fit.score - _elsewhere(right, reference, state, weights) < max(LEAST_LEAD, 2.0 * (1.0 - fit.score)):
        sigma_x_px = math.inf
    return Placed(place_px=state[:2], slope=state[2:], sigma_px=(sigma_x_px, sigma_y_px), score=fit.score)


def _elsewhere(
    right: Patch, reference: NDArray[np.float64], state: NDArray[np.float64], weights: NDArray[np.float64]
) -> float:
    """Return the better score at either side along the line: an edge along the line fits there as well."""
    half = (reference.shape[0] - 1) // 2
    x, y, along, across = state.tolist()
    best = -1.0
    for aside_px in (-ELSEWHERE_PX, ELSEWHERE_PX):
        moved = _normalised(right.cut((half, half), (x + aside_px, y, along, across)), weights)
        if moved is not None:
            best = max(best, float(np.sum(weights * reference * moved)))
    return best


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Fit:
    """Two windows laid on each other: brightness mean 0 and variance 1, weights of sum 1, all (n, n)."""

    left: NDArray[np.float64]
    right: NDArray[np.float64]
    weights: NDArray[np.float64]
    score: float
    variance: float
    """Of one equation: the inverse of the normal matrix times this is the variance of the estimate."""

    @classmethod
    def of(
        cls,
        left: NDArray[np.float64],
        right: NDArray[np.float64],
        weights: NDArray[np.float64],
        samples: float,
    ) -> "_Fit":
        """Lay two windows on each other; `samples`: sum of the weights before they were normalised."""
        score = float(np.sum(weights * left * right))
        misfit = 2.0 * (1.0 - score)  # of two signals of variance 1
        variance = CORRELATION**2 / 2.0 * max(misfit, 0.0) / samples
        return cls(left=left, right=right, weights=weights, score=score, variance=variance)

    @property
    def prior(self) -> NDArray[np.float64]:
        """(4,) what is known beforehand, in the units of the normal matrix."""
        return self.variance / np.array([np.inf, ROW_SIGMA_PX**2, SLOPE_SIGMA**2, SLOPE_SIGMA**2])

    def equations(
        self, axis: NDArray[np.float64], towards: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the (4, 4) normal matrix and the (4,) right-hand side of one step; prior pulls `towards`."""
        columns = _slopes((self.left + self.right) / 2.0, axis)
        weighted = columns * self.weights.ravel()
        normal = weighted @ columns.T + np.diag(self.prior)
        return normal, weighted @ (self.left - self.right).ravel() + self.prior * towards

    def errors_px(self, axis: NDArray[np.float64]) -> tuple[float, float]:
        """Return the standard errors along x and y; infinite where there is nothing but noise.

        Slopes of one image times those of the other: what noise adds to either cancels.
        """
        shared = (_slopes(self.left, axis) * self.weights.ravel()) @ _slopes(self.right, axis).T
        values, ways = np.linalg.eigh((shared + shared.T) / 2.0)
        information = (ways * np.maximum(values, 0.0)) @ ways.T + np.diag(self.prior)
        along_x, along_y = (_alone(information, k) for k in (0, 1))
        return self._error_px(along_x), self._error_px(along_y)

    def _error_px(self, information: float) -> float:
        if not information > 0.0:
            return math.inf
        return math.sqrt(self.variance / information + FLOOR_SIGMA_PX**2)


def _alone(information: NDArray[np.float64], index: int) -> float:
    """Return what is known of one unknown while the others are unknown too: the Schur complement."""
    others = [k for k in range(len(information)) if k != index]
    rest = information[np.ix_(others, others)]
    mixed = information[index, others]
    known = np.linalg.lstsq(rest, mixed, rcond=None)[0]
    return float(information[index, index] - mixed @ known)


def _slopes(image: NDArray[np.float64], axis: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (4, n): how brightness changes with x, y, and with the slope of x along x and along y."""
    slopes = np.zeros((4, *image.shape))
    slopes[0, :, 1:-1] = (image[:, 2:] - image[:, :-2]) / 2.0
    slopes[1, 1:-1, :] = (image[2:, :] - image[:-2, :]) / 2.0
    np.multiply(slopes[0], axis[None, :], out=slopes[2])
    np.multiply(slopes[0], axis[:, None], out=slopes[3])
    return slopes.reshape(4, -1)


def _normalised(image: NDArray[np.float32], weights: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Return the image with weighted mean 0 and variance 1; None when it is all one grey."""
    centred = image - float(np.sum(weights * image))
    deviation = math.sqrt(float(np.sum(weights * centred * centred)))
    return np.asarray(centred / deviation, dtype=np.float64) if deviation > 1e-3 else None
