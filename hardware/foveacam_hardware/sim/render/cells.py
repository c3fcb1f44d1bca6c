"""Cell materials: the mean of a bitmap of cells over a pixel's footprint, by its summed-area table."""

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.sim.render.jit import kernel

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]

PARTS = 4
"""A turned footprint is covered by this many boxes along each of its sides."""


@kernel
def _integral(x: float, y: float, columns: int, rows: int, sums: F64) -> float:
    """Integrate the cells over 0..x, 0..y (cells); nothing lies outside the bitmap."""
    x, y = min(max(x, 0.0), float(columns)), min(max(y, 0.0), float(rows))
    j, i = min(int(x), columns - 1), min(int(y), rows - 1)
    fx, fy = x - j, y - i
    k = i * (columns + 1) + j
    top = sums[k] + fx * (sums[k + 1] - sums[k])
    k += columns + 1
    low = sums[k] + fx * (sums[k + 1] - sums[k])
    return top + fy * (low - top)


@kernel
def _mean(
    x: float, y: float, hx: float, hy: float, columns: int, rows: int, outside: float, sums: F64
) -> float:
    """Return the mean over a box of half sides hx, hy about (x, y), all in cells."""
    x0, x1, y0, y1 = x - hx, x + hx, y - hy, y + hy
    total = (
        _integral(x1, y1, columns, rows, sums)
        - _integral(x0, y1, columns, rows, sums)
        - _integral(x1, y0, columns, rows, sums)
        + _integral(x0, y0, columns, rows, sums)
    )
    wide = min(max(x1, 0.0), float(columns)) - min(max(x0, 0.0), float(columns))
    high = min(max(y1, 0.0), float(rows)) - min(max(y0, 0.0), float(rows))
    area = 4.0 * hx * hy
    return min(1.0, max(0.0, (total + outside * (area - wide * high)) / area))


@kernel
def _cell(x: float, y: float, columns: int, rows: int, outside: float, sums: F64) -> float:
    """Return the value of the cell that (x, y) lies in."""
    j, i = int(np.floor(x)), int(np.floor(y))
    if j < 0 or i < 0 or j >= columns or i >= rows:
        return outside
    k = i * (columns + 1) + j
    return sums[k] - sums[k + 1] - sums[k + columns + 1] + sums[k + columns + 2]


@kernel
def _turned_mean(x: float, y: float, J: F64, columns: int, rows: int, outside: float, sums: F64) -> float:
    """Return the mean over the parallelogram spanned by the columns of J about (x, y)."""
    hx = 0.5 * (abs(J[0, 0]) + abs(J[0, 1])) / PARTS
    hy = 0.5 * (abs(J[1, 0]) + abs(J[1, 1])) / PARTS
    total = 0.0
    for a in range(PARTS):
        for b in range(PARTS):
            s, t = (a + 0.5) / PARTS - 0.5, (b + 0.5) / PARTS - 0.5
            cx, cy = x + s * J[0, 0] + t * J[0, 1], y + s * J[1, 0] + t * J[1, 1]
            total += _mean(cx, cy, hx, hy, columns, rows, outside, sums)
    return total / (PARTS * PARTS)


@kernel
def shade_cells(du: F32, dv: F32, u: float, v: float, J_m: F64, cells: F64, sums: F64, out: F32) -> None:
    """Fill out with the mean of the cells over each footprint, 0..1."""
    cell_m, columns, rows = cells[0], int(cells[1]), int(cells[2])
    table = sums[int(cells[3]) : int(cells[3]) + (columns + 1) * (rows + 1)]
    outside = cells[4]
    J = J_m / cell_m
    wide, high = abs(J[0, 0]) + abs(J[0, 1]), abs(J[1, 0]) + abs(J[1, 1])
    along = min(abs(J[0, 0]), abs(J[0, 1])) < 0.01 * wide and min(abs(J[1, 0]), abs(J[1, 1])) < 0.01 * high
    single = along or min(wide, high) > 4.0
    for i in range(du.shape[0]):
        x, y = (u + du[i]) / cell_m + 0.5 * columns, (v + dv[i]) / cell_m + 0.5 * rows
        if np.floor(x - 0.5 * wide) == np.floor(x + 0.5 * wide) and np.floor(y - 0.5 * high) == np.floor(
            y + 0.5 * high
        ):
            out[i] = np.float32(_cell(x, y, columns, rows, outside, table))
        elif single:
            out[i] = np.float32(_mean(x, y, 0.5 * wide, 0.5 * high, columns, rows, outside, table))
        else:
            out[i] = np.float32(_turned_mean(x, y, J, columns, rows, outside, table))
