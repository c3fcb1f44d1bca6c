"""Visibility in a tile: a z-buffer at the pixel centres, and 4x4 samples in pixels on an edge.

The tile has a border of one pixel, so that edges are found without its neighbours, and its content depends
on the scene and the projection alone.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.jit import part
from foveacam_hardware.sim.render.binning import TileBins
from foveacam_hardware.sim.render.setup import TILE_H, TILE_W, KernelView, VisibleFaces

F64 = NDArray[np.float64]
I32 = NDArray[np.int32]
Step = tuple[float, float, float, float]
"""Derivatives of undistorted x along x and y, then of y; or a function's value, slopes and top at a pixel."""

ROWS, COLUMNS = TILE_H + 2, TILE_W + 2
CREASE = 1e-3
"""Relative distance within which faces of a smooth mesh that meet count as continuous."""
SAMPLES = 16
COUNTED = -2
"""Replaces the face of a sample that has been gathered."""


class TileMemory(NamedTuple):
    """Working memory of one tile, its border included: index [y − y0 + 1, x − x0 + 1]."""

    x: F64  # (ROWS, COLUMNS) undistorted pixel
    y: F64
    q: F64  # (ROWS, COLUMNS) greatest 1/t, 0 where nothing is hit
    face: I32  # (ROWS, COLUMNS) row in VisibleFaces, −1 where nothing is hit
    mark: I32  # (TILE_H · TILE_W,) column of each edge pixel, row after row
    mark_row: I32  # (TILE_H · TILE_W,) and its row
    mark_start: I32  # (ROWS + 1,) first mark of each row
    sample_q: F64  # (TILE_H · TILE_W, SAMPLES)
    sample_face: I32  # (TILE_H · TILE_W, SAMPLES)
    lowest: F64  # (TILE_H · TILE_W,) least q of each mark's samples


@part
def new_tile() -> TileMemory:
    """Allocate the working memory."""
    shape, marks = (ROWS, COLUMNS), TILE_W * TILE_H
    return TileMemory(
        np.zeros(shape),
        np.zeros(shape),
        np.zeros(shape),
        np.zeros(shape, np.int32),
        np.zeros(marks, np.int32),
        np.zeros(marks, np.int32),
        np.zeros(ROWS + 1, np.int32),
        np.zeros((marks, SAMPLES)),
        np.zeros((marks, SAMPLES), np.int32),
        np.zeros(marks),
    )


@part
def load_rays(tile: TileMemory, x0: int, y0: int, view: KernelView) -> None:
    """Fill the undistorted pixels of the tile that begins at image pixel (x0, y0)."""
    for r in range(ROWS):
        for c in range(COLUMNS):
            tile.x[r, c] = x0 + c - 1
            tile.y[r, c] = y0 + r - 1
    if view.shift.shape[0] == 1:
        return
    for r in range(ROWS):
        row = view.shift[min(max(y0 + r - 1, 0), view.height - 1)]
        for c in range(COLUMNS):
            s = row[min(max(x0 + c - 1, 0), view.width - 1)]
            tile.x[r, c] += s[0]
            tile.y[r, c] += s[1]


@part
def _pixel_range(
    low: float, high: float, first: int, size: int, shift0: float, shift1: float
) -> tuple[int, int]:
    """Return the range of tile indices whose undistorted coordinates may lie in low..high."""
    a = max(0.0, np.ceil(low - shift1 - first - 1e-6))
    b = min(size - 1.0, np.floor(high - shift0 - first + 1e-6))
    return (int(a), int(b) + 1) if a <= b else (0, 0)


@part
def fill(
    tile: TileMemory, index: int, x0: int, y0: int, view: KernelView, prims: VisibleFaces, bins: TileBins
) -> None:
    """Find the nearest face at every pixel centre of the tile and its border; the first of equals."""
    xs, ys, q, face = tile.x, tile.y, tile.q, tile.face
    items, box, e, plane, q_max = bins.items, prims.box, prims.edges, prims.q, view.q_max
    s0, s1 = view.tile_shift[index, 0], view.tile_shift[index, 1]
    s2, s3 = view.tile_shift[index, 2], view.tile_shift[index, 3]
    q[:] = 0.0
    face[:] = -1
    for item in range(bins.start[index], bins.start[index + 1]):
        n = items[item]
        left, right = _pixel_range(box[n, 0], box[n, 1], x0 - 1, COLUMNS, s0, s1)
        top, bottom = _pixel_range(box[n, 2], box[n, 3], y0 - 1, ROWS, s2, s3)
        a0, b0, k0, a1, b1, k1 = e[n, 0, 0], e[n, 0, 1], e[n, 0, 2], e[n, 1, 0], e[n, 1, 1], e[n, 1, 2]
        a2, b2, k2, a3, b3, k3 = e[n, 2, 0], e[n, 2, 1], e[n, 2, 2], e[n, 3, 0], e[n, 3, 1], e[n, 3, 2]
        q0, q1, q2 = plane[n, 0], plane[n, 1], plane[n, 2]
        for r in range(np.uintp(top), np.uintp(bottom)):
            for c in range(np.uintp(left), np.uintp(right)):
                x, y = xs[r, c], ys[r, c]
                near = q0 * x + q1 * y + q2
                seen = (
                    (a0 * x + b0 * y + k0 >= 0.0)
                    & (a1 * x + b1 * y + k1 >= 0.0)
                    & (a2 * x + b2 * y + k2 >= 0.0)
                    & (a3 * x + b3 * y + k3 >= 0.0)
                    & (near <= q_max)
                    & (near > q[r, c])
                )
                q[r, c] = near if seen else q[r, c]
                face[r, c] = np.int32(n) if seen else face[r, c]


@part
def mark_edges(tile: TileMemory, height: int, width: int, prims: VisibleFaces, smooth: I32) -> int:
    """List the pixels that are not continuous with all four neighbours, row by row; return their number."""
    face, x, y, q, mark, mark_row, start = (
        tile.face,
        tile.x,
        tile.y,
        tile.q,
        tile.mark,
        tile.mark_row,
        tile.mark_start,
    )
    obj, plane = prims.obj, prims.q
    count = 0
    start[0] = start[1] = 0
    for r in range(1, height + 1):
        for c in range(1, width + 1):
            f = face[r, c]
            if f == face[r, c - 1] and f == face[r, c + 1] and f == face[r - 1, c] and f == face[r + 1, c]:
                continue
            edge = False
            for side in range(4):
                other = face[r + (side == 1) - (side == 0), c + (side == 3) - (side == 2)]
                if other == f or edge:
                    continue
                if f < 0 or other < 0 or obj[f] != obj[other] or smooth[obj[f]] == 0:
                    edge = True
                else:
                    here = plane[other, 0] * x[r, c] + plane[other, 1] * y[r, c] + plane[other, 2]
                    edge = abs(here - q[r, c]) > CREASE * q[r, c]
            if edge:
                mark[count], mark_row[count] = c, r
                count += 1
        start[r + 1] = count
    for r in range(height + 2, ROWS + 1):
        start[r] = count
    return count


@part
def _across(a: float, b: float, c: float, x: float, y: float, step: Step) -> Step:
    """Return a·x + b·y + c at a pixel, its change per pixel along x and y, and its greatest value there."""
    here, dx, dy = a * x + b * y + c, a * step[0] + b * step[2], a * step[1] + b * step[3]
    return here, dx, dy, here + 0.5 * (abs(dx) + abs(dy))


@part
def _test_samples(
    q: F64, face: I32, m: int, n: int, near: Step, edges: tuple[Step, Step, Step, Step], q_max: float
) -> float:
    """Test the samples of mark m against face n; return the least q of them afterwards."""
    p, px, py, _ = near
    (a, ax, ay, _), (b, bx, by, _), (c, cx, cy, _), (d, ex, ey, _) = edges
    least = np.inf
    for s in range(SAMPLES):
        dx, dy = ((s & 3) - 1.5) * 0.25, ((s >> 2) - 1.5) * 0.25
        here = p + dx * px + dy * py
        seen = (
            (a + dx * ax + dy * ay >= 0.0)
            & (b + dx * bx + dy * by >= 0.0)
            & (c + dx * cx + dy * cy >= 0.0)
            & (d + dx * ex + dy * ey >= 0.0)
            & (here <= q_max)
            & (here > q[m, s])
        )
        q[m, s] = here if seen else q[m, s]
        face[m, s] = np.int32(n) if seen else face[m, s]
        least = min(least, q[m, s])
    return float(least)


@part
def sample_edges(
    tile: TileMemory,
    count: int,
    index: int,
    x0: int,
    y0: int,
    view: KernelView,
    prims: VisibleFaces,
    bins: TileBins,
) -> None:
    """Find the nearest face at each of the 4x4 samples of the marked pixels."""
    xs, ys, mark, start, q, face = (
        tile.x, tile.y, tile.mark, tile.mark_start, tile.sample_q, tile.sample_face
    )  # fmt: skip
    lowest, items, box, e, plane, q_max = tile.lowest, bins.items, prims.box, prims.edges, prims.q, view.q_max
    s0, s1 = view.tile_shift[index, 0], view.tile_shift[index, 1]
    s2, s3 = view.tile_shift[index, 2], view.tile_shift[index, 3]
    if count > 0:
        q[:count] = 0.0
        face[:count] = -1
        lowest[:count] = 0.0
    for item in range(bins.start[index], bins.start[index + 1] if count > 0 else 0):
        n = items[item]
        left, right = _pixel_range(box[n, 0] - 0.5, box[n, 1] + 0.5, x0 - 1, COLUMNS, s0, s1)
        top, bottom = _pixel_range(box[n, 2] - 0.5, box[n, 3] + 0.5, y0 - 1, ROWS, s2, s3)
        for r in range(max(top, 1), min(bottom, ROWS - 1)):
            for m in range(start[r], start[r + 1]):
                c = mark[m]
                if c < left or c >= right:
                    continue
                x, y = xs[r, c], ys[r, c]
                step = (
                    0.5 * (xs[r, c + 1] - xs[r, c - 1]),
                    0.5 * (xs[r + 1, c] - xs[r - 1, c]),
                    0.5 * (ys[r, c + 1] - ys[r, c - 1]),
                    0.5 * (ys[r + 1, c] - ys[r - 1, c]),
                )
                near = _across(plane[n, 0], plane[n, 1], plane[n, 2], x, y, step)
                ea = _across(e[n, 0, 0], e[n, 0, 1], e[n, 0, 2], x, y, step)
                eb = _across(e[n, 1, 0], e[n, 1, 1], e[n, 1, 2], x, y, step)
                ec = _across(e[n, 2, 0], e[n, 2, 1], e[n, 2, 2], x, y, step)
                ed = _across(e[n, 3, 0], e[n, 3, 1], e[n, 3, 2], x, y, step)
                if near[3] < lowest[m] or min(min(ea[3], eb[3]), min(ec[3], ed[3])) < 0.0:
                    continue
                lowest[m] = _test_samples(q, face, m, n, near, (ea, eb, ec, ed), q_max)
