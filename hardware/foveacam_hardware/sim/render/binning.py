"""Assignment of faces to the tiles of an image that they may cover."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.jit import kernel, part
from foveacam_hardware.sim.render.setup import TILE_H, TILE_W, KernelView, VisibleFaces

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]
I32 = NDArray[np.int32]


class TileBins(NamedTuple):
    """Faces of each tile: items[start[i]:start[i + 1]], ascending."""

    start: NDArray[np.int64]
    items: I32


@part
def _outside(edges: F64, x0: float, x1: float, y0: float, y1: float) -> bool:
    """Return whether a rectangle lies wholly outside one of four edges."""
    for i in range(4):
        a, b, c = edges[i, 0], edges[i, 1], edges[i, 2]
        if max(a * x0, a * x1) + max(b * y0, b * y1) + c < 0.0:
            return True
    return False


@part
def _visit(
    prims: VisibleFaces, count: int, view: KernelView, bins: TileBins, footprint: NDArray[np.bool_]
) -> None:
    """Count the faces of each tile into start[tile + 1] or, if items has room, store them at start[tile]."""
    fill = bins.items.shape[0] > 0
    columns = (view.width + TILE_W - 1) // TILE_W
    rows = (view.height + TILE_H - 1) // TILE_H
    span = view.tile_shift[-1]
    for n in range(count):
        box = prims.box[n]
        c0 = int(max(0.0, np.floor((box[0] - span[1] - 2.0) / TILE_W)))
        c1 = int(min(columns - 1.0, np.floor((box[1] - span[0] + 2.0) / TILE_W)))
        r0 = int(max(0.0, np.floor((box[2] - span[3] - 2.0) / TILE_H)))
        r1 = int(min(rows - 1.0, np.floor((box[3] - span[2] + 2.0) / TILE_H)))
        exact = (c1 - c0 + 1) * (r1 - r0 + 1) > 8
        for r in range(r0, r1 + 1):
            for c in range(c0, c1 + 1):
                tile = r * columns + c
                s = view.tile_shift[tile]
                x0, x1 = c * TILE_W - 1.0 + s[0], (c + 1) * TILE_W + s[1]
                y0, y1 = r * TILE_H - 1.0 + s[2], (r + 1) * TILE_H + s[3]
                if box[0] > x1 or box[1] < x0 or box[2] > y1 or box[3] < y0:
                    continue
                if exact and _outside(prims.edges[n], x0, x1, y0, y1):
                    continue
                if fill:
                    bins.items[bins.start[tile]] = n
                    bins.start[tile] += 1
                else:
                    bins.start[tile + 1] += 1
                    footprint[prims.obj[n], tile] = True


@kernel
def sort_into_tiles(
    prims: VisibleFaces, count: int, view: KernelView, footprint: NDArray[np.bool_]
) -> TileBins:
    """Return the faces of each tile; fill footprint (objects, tiles): whether a tile may show an object."""
    tiles = footprint.shape[1]
    start = np.zeros(tiles + 1, np.int64)
    empty = TileBins(start, np.empty(0, np.int32))
    _visit(prims, count, view, empty, footprint)
    for tile in range(tiles):
        start[tile + 1] += start[tile]
    bins = TileBins(start, np.empty(start[tiles], np.int32))
    _visit(prims, count, view, bins, footprint)
    for tile in range(tiles, 0, -1):
        start[tile] = start[tile - 1]
    start[0] = 0
    return bins


@kernel
def tile_shifts(shift: F32, width: int, height: int) -> F64:
    """Return least and greatest shift in x, then y, of each tile and a pixel around it, (tiles + 1, 4).

    The last row is that of the whole image.
    """
    columns = (width + TILE_W - 1) // TILE_W
    rows = (height + TILE_H - 1) // TILE_H
    out = np.zeros((columns * rows + 1, 4))
    if shift.shape[0] == 1:
        return out
    for r in range(rows):
        for c in range(columns):
            x0, x1 = max(0, c * TILE_W - 1), min(width, (c + 1) * TILE_W + 1)
            y0, y1 = max(0, r * TILE_H - 1), min(height, (r + 1) * TILE_H + 1)
            tile = r * columns + c
            for k in range(2):
                part = shift[y0:y1, x0:x1, k]
                out[tile, 2 * k] = part.min()
                out[tile, 2 * k + 1] = part.max()
    for k in range(4):
        out[-1, k] = out[:-1, k].min() if k % 2 == 0 else out[:-1, k].max()
    return out
