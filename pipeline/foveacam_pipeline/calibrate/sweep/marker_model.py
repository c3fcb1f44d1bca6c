"""Fit of a blurred image model of a printed square marker to all its pixels.

Corners that are located one by one are shifted inwards by the blur (at an outer corner by some tenths of its
sigma). The unknowns here are a homography, the blur without that by the pixels, the black level, and a white
level with a slope.
"""

from dataclasses import dataclass
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from foveacam_pipeline.calibrate.robust_least_squares import terms_covariance
from foveacam_pipeline.calibrate.sweep.marker_code import CELLS
from foveacam_pipeline.geometry.polynomial import least_squares

Rows: TypeAlias = NDArray[np.float64]
HALF = CELLS / 2
MARGIN_CELLS = 0.6
"""Width of the white margin that is fitted, cells."""
LARGEST_SAMPLE = 3_000
LARGEST_CANDIDATES = 40_000
FLAT_SHARE = 0.1
"""Share of the pixels away from edges that is fitted, to estimate the illumination."""
MAX_STEPS = 25
CONVERGED_PX = 2e-3
HUBER = 2.5
HUBER_SHARE = 0.06
"""Residuals below this share of the contrast keep full weight: the sensor's noise is larger at an edge."""
COST_TOLERANCE = 1.0005
LEAST_BLUR_CELLS = 1e-3
FAR_SIGMAS = 6.0
"""Distance from an edge, in sigmas of its blur, beyond which the blur is neglected."""
BLUR_INDEX = 8
"""Index of the blur in the state: after the homography, before the light."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MarkerFit:
    """A fitted marker.

    `cells_from_px`: (3, 3) from pixels to cells from its middle, -3 to 3. `blur_px`: sigma. `contrast` (white
    minus black), `white` and `noise` (of the residuals): grey levels. `sigma_px`: standard error of a corner.
    `pixels_px`, `misfit`: (n, 2) and (n,), the fitted pixels and their residuals, grey levels.
    """

    cells_from_px: Rows
    blur_px: float
    contrast: float
    white: float
    noise: float
    sigma_px: float
    pixels_px: Rows
    misfit: Rows

    def pixels_of(self, cells: Rows) -> Rows:
        """Return the (n, 2) px of points on the marker, (n, 2) cells from its middle."""
        rows = np.column_stack([cells, np.ones(len(cells))]) @ np.linalg.inv(self.cells_from_px).T
        return np.asarray(rows[:, :2] / rows[:, 2:], dtype=np.float64)


def within(places: Rows, half: float) -> NDArray[np.bool_]:
    """Return the (n,) mask of places, (n, 2), in a square about 0; numpy's `all` over two columns is slow."""
    off = np.abs(places)
    return np.asarray((off[:, 0] <= half) & (off[:, 1] <= half))


def outer_corners() -> Rows:
    """Return the corners of the black square, (4, 2) cells, clockwise from the upper left."""
    return HALF * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def cell_corners(black: Rows) -> Rows:
    """Return the corners inside a marker where edges meet, (k, 2) cells from its middle."""
    corners = []
    for row in range(1, CELLS):
        for column in range(1, CELLS):
            around = black[row - 1 : row + 1, column - 1 : column + 1]
            straight = (around[0] == around[1]).all() or (around[:, 0] == around[:, 1]).all()
            if not straight:
                corners.append((column - HALF, row - HALF))
    return np.array(corners, dtype=np.float64).reshape(-1, 2)


def fit_marker(
    gray: NDArray[np.generic], corners_px: Rows, black: Rows, *, blur_px: float = 1.0
) -> MarkerFit:
    """Fit a marker to an image, (h, w), from its outer corners, (4, 2) px, known to about a blur's width.

    Raise ValueError when the fit diverges from the marker, which happens only where there is none. The damped
    steps stay by hand, as a sweep fits hundreds of markers: scipy's least squares took 1.9 times as long (28
    ms for 15 ms), and its corners were as far from the drawn ones.
    """
    problem = _Problem(gray, corners_px, black, blur_px=blur_px)
    state = problem.start(blur_px)
    damping = 1e-3
    residual, jacobian = problem.linearised(state)
    corners = problem.outer_px(state)
    for _ in range(MAX_STEPS):
        weights = np.sqrt(_huber(residual, state[10]))
        step = _damped_step(jacobian * weights[:, None], residual * weights, damping)
        candidate = state + step
        candidate[BLUR_INDEX] = max(candidate[BLUR_INDEX], 0.2 * state[BLUR_INDEX])
        found, slopes = problem.linearised(candidate)
        if _cost(found) <= _cost(residual) * COST_TOLERANCE:
            before, corners = corners, problem.outer_px(candidate)
            moved_px = float(np.abs(corners - before).max())
            state, residual, jacobian, damping = candidate, found, slopes, max(damping / 10.0, 1e-9)
            if moved_px < CONVERGED_PX:
                break
        else:
            damping *= 10.0
            if damping > 1e3:
                break
    return problem.finished(state, residual, jacobian)


class _Problem:
    """The pixels about one marker; the state is 8 of the homography, blur px, black, white and its slopes."""

    def __init__(self, gray: NDArray[np.generic], corners_px: Rows, black: Rows, *, blur_px: float) -> None:
        self._black = black
        self._corners_px = corners_px
        self._middle_px = corners_px.mean(axis=0)
        self._unit_px = float(np.linalg.norm(corners_px - self._middle_px, axis=1).mean())
        self._guess = _homography(self._scaled(corners_px), outer_corners())
        self.pixels_px = self._sample(gray.shape, blur_px)
        columns = self.pixels_px.astype(np.intp)
        self._values = np.asarray(gray[columns[:, 1], columns[:, 0]], dtype=np.float64)
        self._xy = self._scaled(self.pixels_px)

    def _scaled(self, pixels_px: Rows) -> Rows:
        return np.asarray((pixels_px - self._middle_px) / self._unit_px, dtype=np.float64)

    def _sample(self, shape: tuple[int, ...], blur_px: float) -> Rows:
        """Return pixels on and around the marker: those near edges, and a few of the others."""
        reach = 1.0 + 2.0 * MARGIN_CELLS / CELLS
        edge = self._middle_px + reach * (self._corners_px - self._middle_px)
        x0, y0 = np.maximum(np.floor(edge.min(axis=0)), 0.0)
        x1, y1 = np.minimum(np.ceil(edge.max(axis=0)), np.array([shape[1], shape[0]]) - 1.0)
        pixels = _candidates(int(x0), int(y0), int(x1), int(y1))
        cells = _mapped(self._guess, self._scaled(pixels))
        inside = within(cells, HALF + MARGIN_CELLS)
        pixels, cells = pixels[inside], cells[inside]
        cell_px = np.sqrt(2.0) * self._unit_px / CELLS
        off = np.abs(cells - np.rint(cells))
        near = np.minimum(off[:, 0], off[:, 1]) * cell_px <= 3.0 * blur_px + 1.5
        share = np.where(near, min(1.0, LARGEST_SAMPLE / max(int(near.sum()), 1)), 0.0)
        share[~near] = FLAT_SHARE * share.max(initial=0.0)
        # A seeded random choice, because a regular grid would alias with the cells.
        chosen = np.random.default_rng(len(pixels)).random(len(pixels)) < share
        return np.asarray(pixels[chosen], dtype=np.float64)

    def start(self, blur_px: float) -> Rows:
        if len(self._values) < 200:
            raise ValueError(f"{len(self._values)} pixels are too few for a marker")
        dark, light = np.percentile(self._values, [10.0, 90.0])
        return np.array(
            [*(self._guess.ravel()[:8] / self._guess[2, 2]), blur_px, dark, light - dark, 0.0, 0.0]
        )

    def linearised(self, state: Rows) -> tuple[Rows, Rows]:
        """Return the residuals, image minus model, (n,), and the model's derivatives, (n, 13)."""
        x, y = self._xy[:, 0], self._xy[:, 1]
        g = state[:8]
        below = 1.0 / (g[6] * x + g[7] * y + 1.0)
        u = (g[0] * x + g[1] * y + g[2]) * below
        v = (g[3] * x + g[4] * y + g[5]) * below
        per_px = below / self._unit_px
        across, across_du, across_ds = _cover(
            u, _slopes((g[0] - u * g[6]) * per_px, (g[1] - u * g[7]) * per_px), state[BLUR_INDEX]
        )
        down, down_dv, down_ds = _cover(
            v, _slopes((g[3] - v * g[6]) * per_px, (g[4] - v * g[7]) * per_px), state[BLUR_INDEX]
        )
        rows = self._black.T @ down
        white = 1.0 - _summed(rows, across)
        light = state[10] + (state[11] * u + state[12] * v) / HALF
        by_u = -light * _summed(rows, across_du) + white * state[11] / HALF
        by_v = -light * _summed(self._black.T @ down_dv, across) + white * state[12] / HALF
        by_blur = -light * (_summed(rows, across_ds) + _summed(self._black.T @ down_ds, across))
        by_below = -(by_u * u + by_v * v)
        jacobian = np.empty((len(x), len(state)))
        for column, factor in ((0, by_u), (3, by_v), (6, by_below)):
            jacobian[:, column] = factor * x * below
            jacobian[:, column + 1] = factor * y * below
            if column < 6:
                jacobian[:, column + 2] = factor * below
        jacobian[:, 8] = by_blur
        jacobian[:, 9] = 1.0
        jacobian[:, 10] = white
        jacobian[:, 11] = white * u / HALF
        jacobian[:, 12] = white * v / HALF
        return self._values - state[9] - light * white, jacobian

    def outer_px(self, state: Rows) -> Rows:
        """Return the outer corners, (4, 2) px."""
        back = np.linalg.inv(np.append(state[:8], 1.0).reshape(3, 3))
        outer_px = _mapped(back, outer_corners()) * self._unit_px + self._middle_px
        return np.asarray(outer_px, dtype=np.float64)

    def finished(self, state: Rows, residual: Rows, jacobian: Rows) -> MarkerFit:
        start_px = self._corners_px
        if not np.isfinite(state).all() or self.moved_px_from(start_px, state) > 0.5 * self._unit_px:
            raise ValueError("the fit left the marker")
        noise = 1.4826 * float(np.median(np.abs(residual)))
        to_scaled = np.array(
            [
                [1.0 / self._unit_px, 0.0, -self._middle_px[0] / self._unit_px],
                [0.0, 1.0 / self._unit_px, -self._middle_px[1] / self._unit_px],
                [0.0, 0.0, 1.0],
            ]
        )
        return MarkerFit(
            cells_from_px=np.append(state[:8], 1.0).reshape(3, 3) @ to_scaled,
            blur_px=float(state[BLUR_INDEX]),
            contrast=float(state[10]),
            white=float(state[9] + state[10]),
            noise=noise,
            sigma_px=self._sigma_px(state, jacobian, noise),
            pixels_px=self.pixels_px,
            misfit=residual,
        )

    def moved_px_from(self, corners_px: Rows, state: Rows) -> float:
        return float(np.abs(self.outer_px(state) - corners_px).max())

    def _sigma_px(self, state: Rows, jacobian: Rows, noise: float) -> float:
        """Return the rms standard error of the outer corners' coordinates."""
        covariance = terms_covariance(jacobian)[:BLUR_INDEX, :BLUR_INDEX]
        moved = self._outer_slopes(state)
        return noise * float(np.sqrt(np.mean(np.einsum("ik,kl,il->i", moved, covariance, moved))))

    def _outer_slopes(self, state: Rows) -> Rows:
        """Return the derivatives of the outer corners' coordinates, (8, 8) px, by the homography's terms."""
        back = np.linalg.inv(np.append(state[:8], 1.0).reshape(3, 3))
        cells = np.column_stack([outer_corners(), np.ones(4)])
        rows = cells @ back.T
        # A term (j, k) moves the unscaled point p = back c by -back[:, j] p[k].
        by_term = -np.einsum("aj,nk->najk", back, rows).reshape(4, 3, 9)[:, :, :BLUR_INDEX]
        places = rows[:, :2, None] / rows[:, 2, None, None]
        slopes = (by_term[:, :2] - places * by_term[:, 2:]) / rows[:, 2, None, None]
        return np.asarray(self._unit_px * slopes.reshape(BLUR_INDEX, BLUR_INDEX), dtype=np.float64)


@dataclass(frozen=True, slots=True, eq=False)
class _Slopes:
    """Change of a place on a marker over a pixel, (n,) cells: in all, along the axis of more and of less."""

    whole: Rows
    more: Rows
    less: Rows


def _slopes(by_x: Rows, by_y: Rows) -> _Slopes:
    by_x, by_y = np.abs(by_x), np.abs(by_y)
    return _Slopes(np.hypot(by_x, by_y), np.maximum(by_x, by_y), np.minimum(by_x, by_y))


def _cover(place: Rows, slopes: _Slopes, blur_px: float) -> tuple[Rows, Rows, Rows]:
    """Return (6, n) weights of the cells of a row over pixels, and derivatives by the place and by the blur.

    A pixel is a box along the axis on which the place changes more. Along the other one, on which that of a
    marker that is nearly upright changes little, it counts as blur.
    """
    blur = np.sqrt((slopes.whole * blur_px) ** 2 + slopes.less**2 / 12.0 + LEAST_BLUR_CELLS**2)
    sharpness, half = 1.0 / blur, 0.5 * slopes.more
    middle = np.multiply.outer(-np.arange(-HALF, HALF + 1.0), sharpness) + place * sharpness
    apart = half * sharpness
    (begin, bell_begin), (end, bell_end) = _blurred_steps(middle - apart), _blurred_steps(middle + apart)
    share = 1.0 / (2.0 * apart)
    bells = (bell_end - bell_begin) / np.sqrt(2.0 * np.pi)
    mean = share * ((middle + apart) * end - (middle - apart) * begin + bells)
    by_place = share * sharpness * (end - begin)
    by_blur = share * sharpness * bells * (slopes.whole**2 * blur_px * sharpness)
    return mean[:-1] - mean[1:], by_place[:-1] - by_place[1:], by_blur[:-1] - by_blur[1:]


def _blurred_steps(offset: Rows) -> tuple[Rows, Rows]:
    """Return the normal distribution and its unscaled density, to 1e-9; most points are far from an edge."""
    steps, bells = (offset > 0.0).astype(np.float64), np.zeros(offset.shape)
    near = np.flatnonzero(np.abs(offset) < FAR_SIGMAS)
    at = offset.ravel()[near]
    steps.ravel()[near] = ndtr(at)
    bells.ravel()[near] = np.exp(-0.5 * at * at)
    return steps, bells


def _summed(one: Rows, other: Rows) -> Rows:
    """Return the (n,) sums over cells of the product of two arrays (6, n)."""
    return np.asarray(np.einsum("jn,jn->n", one, other), dtype=np.float64)


def _candidates(x0: int, y0: int, x1: int, y1: int) -> Rows:
    """Return the (n, 2) pixels of a rectangle; of a large one, a seeded random choice."""
    width, count = x1 - x0 + 1, max(0, (x1 - x0 + 1) * (y1 - y0 + 1))
    index = np.arange(count)
    if count > LARGEST_CANDIDATES:
        drawn = np.zeros(count, dtype=np.bool_)
        drawn[np.random.default_rng(count).integers(0, count, LARGEST_CANDIDATES)] = True
        index = np.flatnonzero(drawn)
    return np.column_stack([x0 + index % width, y0 + index // width]).astype(np.float64)


def _huber(residual: Rows, contrast: float) -> Rows:
    limit = max(HUBER * 1.4826 * float(np.median(np.abs(residual))), HUBER_SHARE * abs(contrast), 1e-6)
    return np.minimum(1.0, limit / np.maximum(np.abs(residual), 1e-12))


def _cost(residual: Rows) -> float:
    """Return the sum of absolute residuals, which no single covered corner can dominate."""
    return float(np.abs(residual).sum())


def _damped_step(jacobian: Rows, residual: Rows, damping: float) -> Rows:
    scale = np.linalg.norm(jacobian, axis=0)
    scale[scale == 0.0] = 1.0
    scaled = jacobian / scale
    normal = scaled.T @ scaled + damping * np.eye(len(scale))
    return np.asarray(least_squares(normal, scaled.T @ residual) / scale, dtype=np.float64)


def _homography(source: Rows, target: Rows) -> Rows:
    found = cv2.getPerspectiveTransform(source.astype(np.float32), target.astype(np.float32))
    return np.asarray(found, dtype=np.float64)


def _mapped(matrix: Rows, points: Rows) -> Rows:
    rows = np.column_stack([points, np.ones(len(points))]) @ matrix.T
    return np.asarray(rows[:, :2] / rows[:, 2:], dtype=np.float64)
