"""What is seen at each pixel of a tile: z-buffer at pixel centres, and 4x4 samples where an edge runs through.

The tile carries a border of one pixel, so that edges are found without looking at its neighbours, and
everything in it depends on the scene and the projection alone.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.sim.render.jit import kernel
from foveacam_hardware.sim.render.setup import TILE_H, TILE_W, Bins, Prims, View

F64 = NDArray[np.float64]
I32 = NDArray[np.int32]

ROWS, COLUMNS = TILE_H + 2, TILE_W + 2
CREASE = 1e-3
"""Faces of a smooth mesh that meet within this part of their distance run on into each other."""
SAMPLES = 16


class Tile(NamedTuple):
    """Working memory of one tile, its border included: index [y − y0 + 1, x − x0 + 1]."""

    x: F64  # (ROWS, COLUMNS) undistorted pixel
    y: F64
    q: F64  # (ROWS, COLUMNS) greatest 1/t, 0 where nothing is hit
    face: I32  # (ROWS, COLUMNS) row in Prims, −1 where nothing is hit
    mark: I32  # (TILE_H · TILE_W,) column of each edge pixel, row after row
    mark_start: I32  # (ROWS + 1,) first mark of each row
    sample_q: F64  # (TILE_H · TILE_W, SAMPLES)
    sample_face: I32  # (TILE_H · TILE_W, SAMPLES)


@kernel
def new_tile() -> Tile:
    """Allocate the working memory."""
    shape, marks = (ROWS, COLUMNS), TILE_W * TILE_H
    return Tile(
        np.zeros(shape),
        np.zeros(shape),
        np.zeros(shape),
        np.zeros(shape, np.int32),
        np.zeros(marks, np.int32),
        np.zeros(ROWS + 1, np.int32),
        np.zeros((marks, SAMPLES)),
        np.zeros((marks, SAMPLES), np.int32),
    )


@kernel
def load_rays(tile: Tile, x0: int, y0: int, view: View) -> None:
    """Fill the undistorted pixels of the tile that begins at image pixel (x0, y0)."""
    table = view.shift.shape[0] > 1
    for r in range(ROWS):
        y = y0 + r - 1
        for c in range(COLUMNS):
            x = x0 + c - 1
            tile.x[r, c], tile.y[r, c] = x, y
            if table:
                s = view.shift[min(max(y, 0), view.height - 1), min(max(x, 0), view.width - 1)]
                tile.x[r, c] += s[0]
                tile.y[r, c] += s[1]


@kernel
def _pixel_range(
    low: float, high: float, first: int, size: int, shift0: float, shift1: float
) -> tuple[int, int]:
    """Return the range of tile indices whose undistorted coordinates may lie in low..high."""
    a = int(max(0.0, np.ceil(low - shift1 - first - 1e-6)))
    b = int(min(size - 1.0, np.floor(high - shift0 - first + 1e-6)))
    return a, b + 1


@kernel
def _fill_row(x: F64, y: F64, q: F64, face: I32, e: F64, plane: F64, q_max: float, n: int) -> None:
    """Test one row of pixels against a face, nearest wins, the first of equals."""
    a0, b0, c0 = e[0, 0], e[0, 1], e[0, 2]
    a1, b1, c1 = e[1, 0], e[1, 1], e[1, 2]
    a2, b2, c2 = e[2, 0], e[2, 1], e[2, 2]
    a3, b3, c3 = e[3, 0], e[3, 1], e[3, 2]
    for i in range(x.shape[0]):
        u, v = x[i], y[i]
        near = plane[0] * u + plane[1] * v + plane[2]
        seen = (
            (a0 * u + b0 * v + c0 >= 0.0)
            & (a1 * u + b1 * v + c1 >= 0.0)
            & (a2 * u + b2 * v + c2 >= 0.0)
            & (a3 * u + b3 * v + c3 >= 0.0)
            & (near <= q_max)
            & (near > q[i])
        )
        q[i] = near if seen else q[i]
        face[i] = n if seen else face[i]


@kernel
def fill(tile: Tile, index: int, x0: int, y0: int, view: View, prims: Prims, bins: Bins) -> None:
    """Find the nearest face at every pixel centre of the tile and its border."""
    tile.q[:] = 0.0
    tile.face[:] = -1
    s = view.tile_shift[index]
    for item in range(bins.start[index], bins.start[index + 1]):
        n = bins.items[item]
        box = prims.box[n]
        c0, c1 = _pixel_range(box[0], box[1], x0 - 1, COLUMNS, s[0], s[1])
        r0, r1 = _pixel_range(box[2], box[3], y0 - 1, ROWS, s[2], s[3])
        for r in range(r0, r1):
            if c0 < c1:
                _fill_row(
                    tile.x[r, c0:c1], tile.y[r, c0:c1], tile.q[r, c0:c1], tile.face[r, c0:c1],
                    prims.edges[n], prims.q[n], view.q_max, n,
                )  # fmt: skip


@kernel
def _edge_between(tile: Tile, r: int, c: int, r2: int, c2: int, prims: Prims, smooth: I32) -> bool:
    """Whether what is seen at two neighbouring pixels does not run on from one to the other."""
    a, b = tile.face[r, c], tile.face[r2, c2]
    if a == b:
        return False
    if a < 0 or b < 0 or prims.obj[a] != prims.obj[b] or smooth[prims.obj[a]] == 0:
        return True
    plane = prims.q[b]
    gap = plane[0] * tile.x[r, c] + plane[1] * tile.y[r, c] + plane[2] - tile.q[r, c]
    return abs(gap) > CREASE * tile.q[r, c]


@kernel
def mark_edges(tile: Tile, height: int, width: int, prims: Prims, smooth: I32) -> int:
    """List the pixels through which an edge may run, row by row; return how many."""
    count = 0
    tile.mark_start[0] = tile.mark_start[1] = 0
    for r in range(1, ROWS - 1):
        for c in range(1, COLUMNS - 1):
            f = tile.face[r, c]
            if (
                r > height
                or c > width
                or (
                    f == tile.face[r, c - 1]
                    and f == tile.face[r, c + 1]
                    and f == tile.face[r - 1, c]
                    and f == tile.face[r + 1, c]
                )
            ):
                continue
            if (
                _edge_between(tile, r, c, r, c - 1, prims, smooth)
                or _edge_between(tile, r, c, r, c + 1, prims, smooth)
                or _edge_between(tile, r, c, r - 1, c, prims, smooth)
                or _edge_between(tile, r, c, r + 1, c, prims, smooth)
            ):
                tile.mark[count] = c
                count += 1
        tile.mark_start[r + 1] = count
    return count


@kernel
def sample_x(tile: Tile, r: int, c: int, dx: float, dy: float) -> float:
    """Return the undistorted x of a point (dx, dy) pixels from a pixel's centre."""
    along = dx * 0.5 * (tile.x[r, c + 1] - tile.x[r, c - 1])
    return tile.x[r, c] + along + dy * 0.5 * (tile.x[r + 1, c] - tile.x[r - 1, c])


@kernel
def sample_y(tile: Tile, r: int, c: int, dx: float, dy: float) -> float:
    """Return the undistorted y of a point (dx, dy) pixels from a pixel's centre."""
    along = dx * 0.5 * (tile.y[r, c + 1] - tile.y[r, c - 1])
    return tile.y[r, c] + along + dy * 0.5 * (tile.y[r + 1, c] - tile.y[r - 1, c])


@kernel
def _sample_pixel(tile: Tile, m: int, r: int, n: int, prims: Prims, q_max: float) -> None:
    """Test the samples of one marked pixel against a face."""
    c = tile.mark[m]
    e, plane = prims.edges[n], prims.q[n]
    for s in range(SAMPLES):
        dx, dy = (s % 4 - 1.5) * 0.25, (s // 4 - 1.5) * 0.25
        x, y = sample_x(tile, r, c, dx, dy), sample_y(tile, r, c, dx, dy)
        near = plane[0] * x + plane[1] * y + plane[2]
        if near <= tile.sample_q[m, s] or near > q_max:
            continue
        inside = True
        for k in range(4):
            inside = inside and e[k, 0] * x + e[k, 1] * y + e[k, 2] >= 0.0
        if inside:
            tile.sample_q[m, s] = near
            tile.sample_face[m, s] = n


@kernel
def sample_edges(
    tile: Tile, count: int, index: int, x0: int, y0: int, view: View, prims: Prims, bins: Bins
) -> None:
    """Find the nearest face at each of the 4x4 samples of the marked pixels."""
    tile.sample_q[:count] = 0.0
    tile.sample_face[:count] = -1
    s = view.tile_shift[index]
    for item in range(bins.start[index], bins.start[index + 1]):
        n = bins.items[item]
        box = prims.box[n]
        c0, c1 = _pixel_range(box[0] - 0.5, box[1] + 0.5, x0 - 1, COLUMNS, s[0], s[1])
        r0, r1 = _pixel_range(box[2] - 0.5, box[3] + 0.5, y0 - 1, ROWS, s[2], s[3])
        for r in range(max(r0, 1), min(r1, ROWS - 1)):
            for m in range(tile.mark_start[r], tile.mark_start[r + 1]):
                if c0 <= tile.mark[m] < c1:
                    _sample_pixel(tile, m, r, n, prims, view.q_max)
