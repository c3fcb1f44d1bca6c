"""Cell materials: the mean of a bitmap of cells over a pixel's footprint, by its summed-area table."""

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.sim.render.items import JUX, JUY, JVX, JVY, Items, U, V
from foveacam_hardware.sim.render.jit import inlined, kernel
from foveacam_hardware.sim.render.materials import CELLS, Tables

F64 = NDArray[np.float64]
Four = tuple[float, float, float, float]

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
    return float(top + fy * (low - top))


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
    return float(min(1.0, max(0.0, (total + outside * (area - wide * high)) / area)))


@kernel
def _turned_mean(x: float, y: float, J: Four, columns: int, rows: int, outside: float, sums: F64) -> float:
    """Return the mean over the parallelogram spanned by (J0, J2) and (J1, J3) about (x, y)."""
    hx, hy = 0.5 * (abs(J[0]) + abs(J[1])) / PARTS, 0.5 * (abs(J[2]) + abs(J[3])) / PARTS
    total = 0.0
    for a in range(PARTS):
        for b in range(PARTS):
            s, t = (a + 0.5) / PARTS - 0.5, (b + 0.5) / PARTS - 0.5
            cx, cy = x + s * J[0] + t * J[1], y + s * J[2] + t * J[3]
            total += _mean(cx, cy, hx, hy, columns, rows, outside, sums)
    return float(total / (PARTS * PARTS))


@inlined
def shade_cells(items: Items, count: int, tables: Tables) -> None:
    """Fill the values of all items of cells with their mean over each footprint, 0..1."""
    begin, end, obj, where = items.begin, items.end, items.obj, items.where
    du, dv, value = items.du, items.dv, items.value
    kind, cells = tables.kind, tables.cells
    for m in range(count):
        j = obj[m]
        if kind[j] != CELLS:
            continue
        per_m, columns, rows, outside = 1.0 / cells[j, 0], int(cells[j, 1]), int(cells[j, 2]), cells[j, 4]
        table = tables.sums[int(cells[j, 3]) : int(cells[j, 3]) + (columns + 1) * (rows + 1)]
        u, v = where[m, U] * per_m + 0.5 * columns, where[m, V] * per_m + 0.5 * rows
        J = (where[m, JUX] * per_m, where[m, JUY] * per_m, where[m, JVX] * per_m, where[m, JVY] * per_m)
        wide, high = abs(J[0]) + abs(J[1]), abs(J[2]) + abs(J[3])
        along = min(abs(J[0]), abs(J[1])) < 0.01 * wide and min(abs(J[2]), abs(J[3])) < 0.01 * high
        single = along or min(wide, high) > 4.0
        for i in range(np.uintp(begin[m]), np.uintp(end[m])):
            x, y = u + du[i] * per_m, v + dv[i] * per_m
            column, row = np.floor(x - 0.5 * wide), np.floor(y - 0.5 * high)
            if column == np.floor(x + 0.5 * wide) and row == np.floor(y + 0.5 * high):
                if column < 0.0 or row < 0.0 or column >= columns or row >= rows:
                    value[0, i] = np.float32(outside)
                else:
                    k = np.uintp(row) * np.uintp(columns + 1) + np.uintp(column)
                    below = k + np.uintp(columns + 1)
                    mean = table[k] - table[k + np.uintp(1)] - table[below] + table[below + np.uintp(1)]
                    value[0, i] = np.float32(mean)
            elif single:
                value[0, i] = np.float32(_mean(x, y, 0.5 * wide, 0.5 * high, columns, rows, outside, table))
            else:
                value[0, i] = np.float32(_turned_mean(x, y, J, columns, rows, outside, table))
