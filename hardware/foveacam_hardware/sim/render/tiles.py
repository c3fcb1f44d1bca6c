"""Render whole tiles: visibility, radiance, depth and identity, edges smoothed; one call per band of tiles."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.sim.render.jit import kernel
from foveacam_hardware.sim.render.materials import Tables
from foveacam_hardware.sim.render.setup import TILE_H, TILE_W, Bins, Objects, Prims, View
from foveacam_hardware.sim.render.shade import Run, new_run, shade, shade_sky
from foveacam_hardware.sim.render.visibility import (
    SAMPLES,
    Tile,
    fill,
    load_rays,
    mark_edges,
    new_tile,
    sample_edges,
    sample_x,
    sample_y,
)

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]
I32 = NDArray[np.int32]


class Stage(NamedTuple):
    """Everything that the tiles of one frame are rendered from."""

    camera: View
    objects: Objects
    prims: Prims
    bins: Bins
    tables: Tables  # colours already in the frame's channels
    smooth: I32
    sky: F64  # (2, 3) in the frame's channels
    luma: F64  # (3,)


class Target(NamedTuple):
    """Where the frame is written."""

    radiance: F32  # (h, w, channels)
    depth: F32  # (h, w) metres, infinite where nothing is hit
    ids: I32  # (h, w) object, −1 where nothing is hit


@kernel
def _shade_run(
    tile: Tile, r: int, c: int, end: int, x: int, y: int, run: Run, stage: Stage, target: Target
) -> None:
    """Shade tile columns c..end of row r, which see one face, into the image at (x, y)."""
    f = tile.face[r, c]
    n = end - c
    xs, ys = tile.x[r, c:end], tile.y[r, c:end]
    out = target.radiance[y, x : x + n]
    if f < 0:
        shade_sky(xs, ys, stage.camera.Minv, stage.sky, out)
        target.depth[y, x : x + n] = np.float32(np.inf)
        target.ids[y, x : x + n] = -1
        return
    shade(xs, ys, f, run, stage.prims, stage.objects, stage.tables, stage.luma, out)
    target.ids[y, x : x + n] = stage.prims.obj[f]
    d = stage.camera.depth
    depth = target.depth[y, x : x + n]
    for i in range(n):
        depth[i] = np.float32(run.t[i] * (d[0] * xs[i] + d[1] * ys[i] + d[2]))


@kernel
def _shade_tile(
    tile: Tile, x0: int, y0: int, width: int, height: int, run: Run, stage: Stage, target: Target
) -> None:
    for r in range(1, height + 1):
        c = 1
        while c <= width:
            end = c + 1
            while end <= width and tile.face[r, end] == tile.face[r, c]:
                end += 1
            _shade_run(tile, r, c, end, x0 + c - 1, y0 + r - 1, run, stage, target)
            c = end


@kernel
def _sample_colour(
    tile: Tile, m: int, r: int, first: int, run: Run, stage: Stage, point: F64, one: F32
) -> int:
    """Shade what sample `first` sees, at the centroid of all samples that see it; return how many do."""
    f = tile.sample_face[m, first]
    count, dx, dy = 0, 0.0, 0.0
    for s in range(first, SAMPLES):
        if tile.sample_face[m, s] == f:
            count += 1
            dx += (s % 4 - 1.5) * 0.25
            dy += (s // 4 - 1.5) * 0.25
    c = tile.mark[m]
    point[0, 0] = sample_x(tile, r, c, dx / count, dy / count)
    point[1, 0] = sample_y(tile, r, c, dx / count, dy / count)
    if f < 0:
        shade_sky(point[0], point[1], stage.camera.Minv, stage.sky, one)
    else:
        shade(point[0], point[1], f, run, stage.prims, stage.objects, stage.tables, stage.luma, one)
    return count


@kernel
def _resolve(tile: Tile, x0: int, y0: int, run: Run, stage: Stage, radiance: F32) -> None:
    """Replace the radiance of marked pixels by the mean over their samples."""
    channels = radiance.shape[2]
    point, one = np.empty((2, 1)), np.zeros((1, channels), np.float32)
    total = np.zeros(channels, np.float32)
    for r in range(1, TILE_H + 1):
        for m in range(tile.mark_start[r], tile.mark_start[r + 1]):
            total[:] = np.float32(0.0)
            for s in range(SAMPLES):
                known = False
                for before in range(s):
                    known = known or tile.sample_face[m, before] == tile.sample_face[m, s]
                if known:
                    continue
                count = _sample_colour(tile, m, r, s, run, stage, point, one)
                for k in range(channels):
                    total[k] += one[0, k] * np.float32(count / SAMPLES)
            radiance[y0 + r - 1, x0 + tile.mark[m] - 1] = total


@kernel
def render_tiles(tiles: NDArray[np.int64], stage: Stage, target: Target) -> None:
    """Render the tiles of these numbers (row by row from the top left)."""
    view = stage.camera
    columns = (view.width + TILE_W - 1) // TILE_W
    tile, run = new_tile(), new_run()
    for index in tiles:
        x0, y0 = (index % columns) * TILE_W, (index // columns) * TILE_H
        width, height = min(TILE_W, view.width - x0), min(TILE_H, view.height - y0)
        load_rays(tile, x0, y0, view)
        fill(tile, index, x0, y0, view, stage.prims, stage.bins)
        _shade_tile(tile, x0, y0, width, height, run, stage, target)
        marks = mark_edges(tile, height, width, stage.prims, stage.smooth)
        if marks > 0:
            sample_edges(tile, marks, index, x0, y0, view, stage.prims, stage.bins)
            _resolve(tile, x0, y0, run, stage, target.radiance)
