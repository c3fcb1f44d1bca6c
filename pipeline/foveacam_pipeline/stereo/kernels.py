"""Compiled kernels: the sub-pixel step of `live` on cells of 2 x 2 px, map enlargement, and occlusion.

The module is imported when depth is first computed, because it loads numba.

Windows are (h, w) uint8, maps of cells (h / 2, w / 2) float32, with
disparities in px of the full size, NaN where unknown; rows of a window are float32.
"""

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.jit import kernel
from foveacam_pipeline.stereo.refine import CORRELATION, LEAST_ENERGY, LEAST_NOISE, PRIOR_SIGMA_PX

F32 = NDArray[np.float32]
U8 = NDArray[np.uint8]

RIM, MIDDLE = np.float32(0.23899), np.float32(0.52202)
"""A Gaussian of `refine.PRE_SIGMA_PX` over three pixels."""
NEAR_TAP, FAR_TAP = np.float32(8 / 12), np.float32(1 / 12)
"""Derivative along x, right to fourth order, as `refine.SLOPE`."""
OWN, OTHER = np.float32(0.75), np.float32(0.25)
"""Interpolation weights of a cell and its neighbour at a pixel, a quarter of a cell from the centre."""

ENERGY, OWN_ENERGY, SLOPE, DIFFERENCE, PRODUCT, SQUARE, KNOWN = range(7)
"""Sums of a cell over its four pixels, and 1 where its disparity is known."""
REFINED, STEP, NOISE, NOISE_SIGMA, MEAN_ENERGY, MEAN_OWN_ENERGY = range(6)
"""Rows of the result of `refine_cells`; `refine.Refinement` is built from them."""

_ZERO, _HALF, _ONE, _TWO = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(2.0)
_LEAST_VARIANCE, _LEAST_ENERGY = np.float32(LEAST_NOISE**2), np.float32(LEAST_ENERGY)
_PER_CELL = np.float32(CORRELATION**2 / 4)
_PER_PRIOR = np.float32(1.0 / PRIOR_SIGMA_PX**2)
_NOTHING = np.float32(-1e6)
"""Disparity of no surface: farther than everything."""


@kernel
def _smooth_row(image: U8, y: int, scratch: F32, out: F32) -> None:
    """Fill `out` (2, w) with row y of a picture, smoothed by a Gaussian, and with its derivative along x."""
    h, w = image.shape
    above, below = max(y - 1, 0), min(y + 1, h - 1)
    column, row = scratch[0], scratch[1]
    for x in range(w):
        rims = np.float32(image[above, x]) + np.float32(image[below, x])
        column[x + 1] = RIM * rims + MIDDLE * np.float32(image[y, x])
    column[0], column[w + 1] = column[1], column[w]
    for x in range(w):
        row[x + 2] = RIM * (column[x] + column[x + 2]) + MIDDLE * column[x + 1]
    row[0], row[1], row[w + 2], row[w + 3] = row[2], row[2], row[w + 1], row[w + 1]
    for x in range(w):
        out[0, x] = row[x + 2]
        out[1, x] = NEAR_TAP * (row[x + 3] - row[x + 1]) - FAR_TAP * (row[x + 4] - row[x])


@kernel
def fill_row(cells: F32, y: int, bend: np.float32, between: F32, out: F32) -> None:
    """Fill `out` (w,) with row y of a map of cells at full size; `between`: (w / 2 + 2,) of scratch.

    Interpolated between cells that differ by at most `bend`, else the pixel's own cell.
    """
    n, m = cells.shape
    r = y >> 1
    other = max(r - 1, 0) if y & 1 == 0 else min(r + 1, n - 1)
    for k in range(m):
        a, b = cells[r, k], cells[other, k]
        between[k + 1] = OWN * a + OTHER * b if abs(a - b) <= bend else a
    between[0], between[m + 1] = between[1], between[m]
    for k in range(m):
        a, b, c = between[k + 1], between[k], between[k + 2]
        out[2 * k] = OWN * a + OTHER * b if abs(a - b) <= bend else a
        out[2 * k + 1] = OWN * a + OTHER * c if abs(a - c) <= bend else a


@kernel
def enlarge_cells(cells: F32, bend: np.float32, begin: int, valid: NDArray[np.bool_], out: F32) -> None:
    """Fill `out` (h, w) with a map of cells at full size, from its row `begin` on, NaN where not `valid`."""
    between = np.empty(cells.shape[1] + 2, np.float32)
    for y in range(out.shape[0]):
        fill_row(cells, begin + y, bend, between, out[y])
        for x in range(out.shape[1]):
            if not valid[y, x]:
                out[y, x] = np.nan


@kernel
def _compare_row(
    left: F32, right: F32, disparity: F32, index: NDArray[np.int32], part: F32, out: F32
) -> None:
    """Fill `out` (2, w) with the difference to the matched pixels and with the slopes of these."""
    w = left.shape[1]
    last = np.float32(w - 1)
    for x in range(w):
        column = min(max(np.float32(x) - disparity[x], _ZERO), last)
        if not column >= _ZERO:  # of an unknown disparity
            column = _ZERO
        index[x] = min(np.int32(column), np.int32(w - 2))
        part[x] = column - np.float32(index[x])
    for x in range(w):
        i, f = index[x], part[x]
        a, b = right[0, i], right[0, i + 1]
        out[0, x] = left[0, x] - (a + f * (b - a))
        a, b = right[1, i], right[1, i + 1]
        out[1, x] = a + f * (b - a)


@kernel
def _add_row(left_slope: F32, compared: F32, disparity: F32, sums: F32) -> None:
    """Add a row of pixels to the sums (7, m) of its cells; pixels of unknown disparity are left out."""
    for k in range(sums.shape[1]):
        x = 2 * k
        a, b, d = left_slope[x], compared[1, x], compared[0, x]
        s = _HALF * (a + b)
        a1, b1, d1 = left_slope[x + 1], compared[1, x + 1], compared[0, x + 1]
        s1 = _HALF * (a1 + b1)
        one = _ONE if disparity[x] == disparity[x] else _ZERO
        sums[ENERGY, k] += one * (a * b + a1 * b1)
        sums[OWN_ENERGY, k] += one * (s * s + s1 * s1)
        sums[SLOPE, k] += one * (s + s1)
        sums[DIFFERENCE, k] += one * (d + d1)
        sums[PRODUCT, k] += one * (s * d + s1 * d1)
        sums[SQUARE, k] += one * (d * d + d1 * d1)
        sums[KNOWN, k] += one * _HALF


@kernel
def _solve_row(tall: F32, disparity: F32, largest_step: np.float32, out: F32) -> None:
    """Fill `out` (6, m) from sums over three rows of cells, (7, m + 2): see `refine._gauss_newton`."""
    for k in range(disparity.shape[0]):
        count = max(tall[KNOWN, k] + tall[KNOWN, k + 1] + tall[KNOWN, k + 2], _ONE)
        share = np.float32(0.25) / count
        energy = (tall[ENERGY, k] + tall[ENERGY, k + 1] + tall[ENERGY, k + 2]) * share
        own = (tall[OWN_ENERGY, k] + tall[OWN_ENERGY, k + 1] + tall[OWN_ENERGY, k + 2]) * share
        slope = (tall[SLOPE, k] + tall[SLOPE, k + 1] + tall[SLOPE, k + 2]) * share
        difference = (tall[DIFFERENCE, k] + tall[DIFFERENCE, k + 1] + tall[DIFFERENCE, k + 2]) * share
        product = (tall[PRODUCT, k] + tall[PRODUCT, k + 1] + tall[PRODUCT, k + 2]) * share
        square = (tall[SQUARE, k] + tall[SQUARE, k + 1] + tall[SQUARE, k + 2]) * share
        energy -= slope * slope
        variance = max(square - difference * difference, _LEAST_VARIANCE)
        safe_energy = max(energy, _LEAST_ENERGY)
        step = (slope * difference - product) / safe_energy
        step_variance = _PER_CELL * variance / (safe_energy * count)
        applied = step / (_ONE + step_variance * _PER_PRIOR)
        out[REFINED, k] = disparity[k] + (applied if abs(step) <= largest_step else _ZERO)
        out[STEP, k] = step
        out[NOISE, k] = np.sqrt(variance)
        out[NOISE_SIGMA, k] = np.sqrt(step_variance)
        out[MEAN_ENERGY, k] = energy
        out[MEAN_OWN_ENERGY, k] = _TWO * (own - slope * slope) - energy


@kernel
def refine_cells(left: U8, right: U8, cells: F32, bend: np.float32, largest_step: np.float32) -> F32:
    """Return (6, n, m) the result of one Gauss-Newton step over 3 x 3 cells on a map of cells (n, m).

    `left`, `right`: (2 n, 2 m) grey windows. A step beyond `largest_step` is not applied.
    """
    n, m = cells.shape
    out = np.empty((6, n, m), np.float32)
    ring, tall = np.zeros((3, 7, m), np.float32), np.zeros((7, m + 2), np.float32)
    disparity, between = np.empty(2 * m, np.float32), np.empty(m + 2, np.float32)
    index, part = np.empty(2 * m, np.int32), np.empty(2 * m, np.float32)
    rows, scratch = np.empty((3, 2, 2 * m), np.float32), np.empty((2, 2 * m + 4), np.float32)
    left_row, right_row, compared = rows[0], rows[1], rows[2]
    for r in range(n + 1):
        sums = ring[r % 3]
        sums[:] = _ZERO
        if r < n:
            for y in (2 * r, 2 * r + 1):
                fill_row(cells, y, bend, between, disparity)
                _smooth_row(left, y, scratch, left_row)
                _smooth_row(right, y, scratch, right_row)
                _compare_row(left_row, right_row, disparity, index, part, compared)
                _add_row(left_row[1], compared, disparity, sums)
        if r > 0:
            above, own = ring[(r + 1) % 3], ring[(r + 2) % 3]  # rows r - 2 and r - 1
            for q in range(7):
                for k in range(m):
                    tall[q, k + 1] = above[q, k] + own[q, k] + sums[q, k]
            _solve_row(tall, cells[r - 1], largest_step, out[:, r - 1])
    return out


@kernel
def _fill_background(disparity: F32, filled: F32) -> None:
    """Fill the holes of a row with the farther of their two known neighbours."""
    w = disparity.shape[0]
    latest = _NOTHING
    for x in range(w):
        if disparity[x] == disparity[x]:
            latest = disparity[x]
        filled[x] = latest
    latest = _NOTHING
    for x in range(w - 1, -1, -1):
        if disparity[x] == disparity[x]:
            latest = disparity[x]
        elif filled[x] == _NOTHING or (latest != _NOTHING and latest < filled[x]):
            filled[x] = latest


@kernel
def _nearest_at_right(disparity: F32, column: NDArray[np.int32], nearest: F32) -> None:
    """Fill `nearest` (w + 4,), a rim of 2 px on either side, with the nearest surface at each right pixel.

    Gaps of up to 2 px are closed: the largest of three, then the smallest of three.
    """
    w = disparity.shape[0]
    nearest[:] = _NOTHING
    for x in range(w):
        if column[x] >= 0 and disparity[x] == disparity[x]:
            nearest[column[x] + 2] = max(nearest[column[x] + 2], disparity[x])
    before = nearest[0]
    for x in range(1, w + 3):
        here = nearest[x]
        nearest[x] = max(before, here, nearest[x + 1])
        before = here
    before = nearest[1]
    for x in range(2, w + 2):
        here = nearest[x]
        nearest[x] = min(before, here, nearest[x + 1])
        before = here


@kernel
def mark_hidden(disparity: F32, per_px: np.float32, nearer: np.float32, hidden: NDArray[np.uint8]) -> None:
    """Fill `hidden` (h, w) with 1 where a surface nearer by `nearer` px hides the pixel at right, else 0.

    `disparity`: (h, w) px, NaN where unknown; `per_px`: shift in columns per px of disparity.
    """
    h, w = disparity.shape
    filled, nearest, column = np.empty(w, np.float32), np.empty(w + 4, np.float32), np.empty(w, np.int32)
    for y in range(h):
        _fill_background(disparity[y], filled)
        for x in range(w):
            at = np.int32(np.floor(np.float32(x) - per_px * filled[x] + np.float32(0.5)))
            column[x] = at if filled[x] != _NOTHING and 0 <= at < w else -1
        _nearest_at_right(disparity[y], column, nearest)
        for x in range(w):
            visible = column[x] < 0 or nearest[column[x] + 2] <= filled[x] + nearer
            hidden[y, x] = 0 if visible else 1
