"""Cell materials: the mean of a bitmap of cells over a pixel's footprint, by its summed-area table."""

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.jit import part
from foveacam_hardware.sim.render.batch import CAPACITY, PixelBatch
from foveacam_hardware.sim.render.items import FROM_U, FROM_V, LookupItems, U, V
from foveacam_hardware.sim.render.materials import CELLS, MaterialTables
from foveacam_hardware.sim.render.setup import ObjectTable, VisibleFaces

F64 = NDArray[np.float64]
Four = tuple[float, float, float, float]

PARTS = 4
"""A rotated footprint is covered by this many boxes along each of its sides."""


@part
def _integral(x: float, y: float, columns: int, rows: int, sums: F64) -> float:
    """Integrate the cells over 0..x, 0..y (cells); the outside of the bitmap counts as 0."""
    x, y = min(max(x, 0.0), float(columns)), min(max(y, 0.0), float(rows))
    j, i = min(int(x), columns - 1), min(int(y), rows - 1)
    fx, fy = x - j, y - i
    k = i * (columns + 1) + j
    top = sums[k] + fx * (sums[k + 1] - sums[k])
    k += columns + 1
    low = sums[k] + fx * (sums[k + 1] - sums[k])
    return float(top + fy * (low - top))


@part
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


@part
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


@part
def _cell_mean(x: float, y: float, J: Four, columns: int, rows: int, outside: float, table: F64) -> float:
    """Return the mean over a footprint about (x, y): one cell, one box, or a parallelogram."""
    wide, high = abs(J[0]) + abs(J[1]), abs(J[2]) + abs(J[3])
    column, row = np.floor(x - 0.5 * wide), np.floor(y - 0.5 * high)
    if column == np.floor(x + 0.5 * wide) and row == np.floor(y + 0.5 * high):
        if column < 0.0 or row < 0.0 or column >= columns or row >= rows:
            return outside
        k = int(row) * (columns + 1) + int(column)
        return float(table[k] - table[k + 1] - table[k + columns + 1] + table[k + columns + 2])
    upright = min(abs(J[0]), abs(J[1])) < 0.01 * wide and min(abs(J[2]), abs(J[3])) < 0.01 * high
    if upright or min(wide, high) > 4.0:
        return float(_mean(x, y, 0.5 * wide, 0.5 * high, columns, rows, outside, table))
    return float(_turned_mean(x, y, J, columns, rows, outside, table))


@part
def _footprint(t: float, u: float, v: float, rows: tuple[float, ...], plane: tuple[float, float]) -> Four:
    """Return cells of u per pixel along x and y, then of v; (u, v) is relative to the camera."""
    return (
        t * (rows[0] - plane[0] * u),
        t * (rows[1] - plane[1] * u),
        t * (rows[2] - plane[0] * v),
        t * (rows[3] - plane[1] * v),
    )


@part
def shade_cells(
    batch: PixelBatch,
    items: LookupItems,
    count: int,
    prims: VisibleFaces,
    objects: ObjectTable,
    tables: MaterialTables,
) -> None:
    """Fill the values of all items of cells with their mean over the footprint of each pixel, 0..1."""
    begin, end, obj, where, sides = items.begin, items.end, items.obj, items.where, items.side
    du, dv, value, faces, q, A = items.du, items.dv, items.value, items.face, prims.q, objects.A
    ts, kind, cells = batch.t, tables.kind, tables.cells
    for m in range(count):
        j = obj[m]
        if kind[j] != CELLS:
            continue
        per_m, columns, rows, outside = 1.0 / cells[j, 0], int(cells[j, 1]), int(cells[j, 2]), cells[j, 4]
        table = tables.sums[int(cells[j, 3]) : int(cells[j, 3]) + (columns + 1) * (rows + 1)]
        u, v = where[m, U] * per_m + 0.5 * columns, where[m, V] * per_m + 0.5 * rows
        axis, plane = sides[m] >> 1, (q[faces[m], 0], q[faces[m], 1])
        iu, iv = (2 if axis == 0 else 0), (2 if axis == 1 else 1)
        ray = (A[j, iu, 0] * per_m, A[j, iu, 1] * per_m, A[j, iv, 0] * per_m, A[j, iv, 1] * per_m)
        shift = np.uintp(axis * CAPACITY)
        for i in range(np.uintp(begin[m]), np.uintp(end[m])):
            x, y, p = u + du[i] * per_m, v + dv[i] * per_m, i - shift
            from_u, from_v = (where[m, FROM_U] + du[i]) * per_m, (where[m, FROM_V] + dv[i]) * per_m
            J = _footprint(ts[p], from_u, from_v, ray, plane)
            value[0, i] = np.float32(_cell_mean(x, y, J, columns, rows, outside, table))
