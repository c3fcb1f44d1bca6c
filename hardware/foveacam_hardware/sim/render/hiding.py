"""Occlusion culling: tiles of a picture that a layer in front of it hides need not be drawn."""

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.jit import kernel, part
from foveacam_hardware.sim.render.setup import TILE_H, TILE_W
from foveacam_hardware.sim.render.smear import MovingLayer
from foveacam_hardware.sim.render.tiles import TileInputs

F64 = NDArray[np.float64]
I32 = NDArray[np.int32]
I64 = NDArray[np.int64]


@kernel
def hiding_depths(layer: MovingLayer, steps: I32, width: int, height: int) -> F64:
    """Return, for each tile of a picture, the depth beyond which a layer in front hides it in every step, m.

    `steps`: as in `smear`. Infinite where it does not.
    """
    columns, rows = (width + TILE_W - 1) // TILE_W, (height + TILE_H - 1) // TILE_H
    found = np.full(columns * rows, np.inf)
    for r in range(rows):
        y0, y1 = r * TILE_H + layer.margin_y, min((r + 1) * TILE_H, height) + layer.margin_y
        for c in range(columns):
            x0, x1 = c * TILE_W + layer.margin_x, min((c + 1) * TILE_W, width) + layer.margin_x
            shown = layer.ids[(y0 + y1) // 2, (x0 + x1) // 2]
            if shown >= 0:
                g = layer.group[shown]
                left, right = x0 - steps[:, g, 0].max(), x1 - steps[:, g, 0].min()
                top, bottom = y0 - steps[:, g, 1].max(), y1 - steps[:, g, 1].min()
                found[r * columns + c] = _depth_of_all(layer, g, left, right, top, bottom)
    return found


@part
def _depth_of_all(layer: MovingLayer, group: int, left: int, right: int, top: int, bottom: int) -> float:
    """Return the largest depth in a part of a layer that one group covers wholly, else infinity."""
    deepest, cover = np.float32(0.0), layer.radiance.shape[2] - 1
    for v in range(top, bottom):
        for u in range(left, right):
            shown = layer.ids[v, u]
            if shown < 0 or layer.group[shown] != group or layer.radiance[v, u, cover] < np.float32(1.0):
                return np.inf
            deepest = max(deepest, layer.depth[v, u])
    return float(deepest)


def nearest_depths(stage: TileInputs, tiles: I64) -> F64:
    """Return, for each of `tiles`, a depth that nothing in it is nearer than, m.

    1/t and depth/t of a face are linear in the pixel (`setup`), so that its nearest point is in a corner.
    """
    first, end = stage.bins.start[tiles], stage.bins.start[tiles + 1]
    counts = end - first
    owner = np.repeat(np.arange(len(tiles)), counts)
    before = np.cumsum(counts) - counts
    faces = stage.bins.items[np.arange(len(owner)) + (first - before)[owner]]
    corners = _corners_px(stage, tiles)
    per_t = np.einsum("nki,ni->nk", corners[owner], stage.prims.q[faces])
    depth_m = np.full(per_t.shape, np.inf)
    np.divide((corners @ stage.camera.depth)[owner], per_t, out=depth_m, where=per_t > 0.0)
    nearest = np.full(len(tiles), np.inf)
    np.minimum.at(nearest, owner, depth_m.min(axis=1, initial=np.inf))
    return nearest


def _corners_px(stage: TileInputs, tiles: I64) -> F64:
    """Return the corners (n, 4, 3) of tiles and a pixel around them, homogeneous undistorted px."""
    row, column = np.divmod(tiles, -(-stage.camera.width // TILE_W))
    shift = stage.camera.tile_shift[tiles]
    x = np.stack([column * TILE_W - 1.0 + shift[:, 0], (column + 1.0) * TILE_W + shift[:, 1]], axis=1)
    y = np.stack([row * TILE_H - 1.0 + shift[:, 2], (row + 1.0) * TILE_H + shift[:, 3]], axis=1)
    return np.stack([x[:, [0, 1, 0, 1]], y[:, [0, 0, 1, 1]], np.ones((len(tiles), 4))], axis=2)
