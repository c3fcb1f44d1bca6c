"""Renders whole tiles: visibility, radiance, depth, object numbers and smoothed edges, a band per call."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.jit import cached_part, kernel, part
from foveacam_hardware.sim.render.batch import CAPACITY, PixelBatch, gather, interpolate, new_batch, shade_sky
from foveacam_hardware.sim.render.binning import TileBins
from foveacam_hardware.sim.render.cells import shade_cells
from foveacam_hardware.sim.render.items import LookupItems, add_up, find_items, new_items
from foveacam_hardware.sim.render.materials import MaterialTables
from foveacam_hardware.sim.render.setup import TILE_H, TILE_W, KernelView, ObjectTable, VisibleFaces
from foveacam_hardware.sim.render.shade import paint, shade_bitmap, shade_noise
from foveacam_hardware.sim.render.visibility import (
    COUNTED,
    CREASE,
    SAMPLES,
    TileMemory,
    fill,
    load_rays,
    mark_edges,
    new_tile,
    sample_edges,
)

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]
I32 = NDArray[np.int32]


class TileInputs(NamedTuple):
    """The inputs of all tiles of one frame."""

    camera: KernelView
    objects: ObjectTable
    prims: VisibleFaces
    bins: TileBins
    tables: MaterialTables  # colours in the frame's channels
    smooth: I32
    sky: F64  # (2, channels)
    luma: F64  # (3,)
    cut_px: float  # shortest wavelength of noise that is drawn


class TileOutputs(NamedTuple):
    """The output arrays of a frame."""

    radiance: F32  # (h, w, channels)
    depth: F32  # (h, w) metres, infinite where nothing is hit
    ids: I32  # (h, w) object, −1 where nothing is hit


@cached_part
def find_runs(
    tile: TileMemory,
    index: int,
    x0: int,
    y0: int,
    width: int,
    height: int,
    stage: TileInputs,
    batch: PixelBatch,
) -> int:
    """Find what each pixel of a tile shows, and fill the batch with it; return the number of runs."""
    load_rays(tile, x0, y0, stage.camera)
    fill(tile, index, x0, y0, stage.camera, stage.prims, stage.bins)
    runs: int = gather(tile.x, tile.y, tile.face, width, height, batch)
    return runs


@cached_part
def find_marks(
    tile: TileMemory, index: int, x0: int, y0: int, width: int, height: int, stage: TileInputs
) -> int:
    """Find the pixels of a tile that lie on an edge, and what their samples show; return their number."""
    marks: int = mark_edges(tile, height, width, stage.prims, stage.smooth)
    sample_edges(tile, marks, index, x0, y0, stage.camera, stage.prims, stage.bins)
    return marks


@cached_part
def shade_runs(batch: PixelBatch, runs: int, items: LookupItems, stage: TileInputs, colour: F32) -> None:
    """Fill colour (CAPACITY, channels) for all runs of the batch."""
    interpolate(batch, runs, stage.prims.q, stage.prims.light)
    shade_sky(batch, runs, stage.camera.Minv)
    count = find_items(batch, runs, stage.prims, stage.objects, stage.tables, items)
    shade_noise(items, count, stage.smooth, stage.tables, stage.cut_px)
    shade_cells(batch, items, count, stage.prims, stage.objects, stage.tables)
    shade_bitmap(items, count, stage.tables)
    add_up(batch, runs, stage.prims, stage.tables, items)
    paint(batch, runs, stage.prims.obj, stage.tables, stage.sky, stage.luma, colour)


@part
def _store(
    batch: PixelBatch,
    runs: int,
    x0: int,
    y0: int,
    width: int,
    height: int,
    stage: TileInputs,
    colour: F32,
    target: TileOutputs,
) -> None:
    """Write a tile's colour, depth and ids into the image."""
    d0, d1, d2 = stage.camera.depth[0], stage.camera.depth[1], stage.camera.depth[2]
    face, first, x, y, t, obj = batch.face, batch.first, batch.x, batch.y, batch.t, stage.prims.obj
    radiance, depth, ids, channels = target.radiance, target.depth, target.ids, colour.shape[1]
    w, left = np.uintp(width), np.uintp(x0)
    for r in range(height):
        row, shift = np.uintp(y0 + r), np.uintp(r) * w
        for i in range(w):
            p = shift + i
            depth[row, left + i] = np.float32(t[p] * (d0 * x[p] + d1 * y[p] + d2))
        for c in range(channels):
            for i in range(w):
                radiance[row, left + i, c] = colour[shift + i, c]
    for k in range(runs):
        f = face[k]
        a, b = np.uintp(first[k]), np.uintp(first[k + 1])
        row, shift = np.uintp(y0) + a // w, left + a % w - a
        j = obj[f] if f >= 0 else np.int32(-1)
        for i in range(a, b):
            ids[row, i + shift] = j
        if f < 0:
            for i in range(a, b):
                depth[row, i + shift] = np.float32(np.inf)


@cached_part
def gather_marks(
    tile: TileMemory,
    mark: int,
    marks: int,
    stage: TileInputs,
    batch: PixelBatch,
    weight: F32,
    start: I32,
) -> tuple[int, int]:
    """Fill the batch from as many marks as fit, from `mark` on; return the runs and the next mark.

    Every face that the samples of a mark show becomes a run of one pixel, at the centroid of those samples;
    continuous faces of a smooth object become one.
    """
    faces, columns, rows, tx, ty = tile.sample_face, tile.mark, tile.mark_row, tile.x, tile.y
    sample_q, q, obj, centre = tile.sample_q, stage.prims.q, stage.prims.obj, tile.face
    smooth = stage.smooth
    first, face, x, y = batch.first, batch.face, batch.x, batch.y
    runs = 0
    while mark < marks and runs + SAMPLES <= CAPACITY:
        start[mark] = runs
        c, r = columns[mark], rows[mark]
        xx, xy = 0.5 * (tx[r, c + 1] - tx[r, c - 1]), 0.5 * (tx[r + 1, c] - tx[r - 1, c])
        yx, yy = 0.5 * (ty[r, c + 1] - ty[r, c - 1]), 0.5 * (ty[r + 1, c] - ty[r - 1, c])
        for s in range(SAMPLES):
            f = faces[mark, s]
            if f == COUNTED:
                continue
            merge = f >= 0 and smooth[obj[f]] == 1
            count, sx, sy = 0, 0.0, 0.0
            for other in range(s, SAMPLES):
                g = faces[mark, other]
                dx, dy = (other % 4 - 1.5) * 0.25, (other // 4 - 1.5) * 0.25
                same = g == f
                if merge and not same and g >= 0 and obj[g] == obj[f]:
                    px, py = tx[r, c] + dx * xx + dy * xy, ty[r, c] + dx * yx + dy * yy
                    gap = q[f, 0] * px + q[f, 1] * py + q[f, 2] - sample_q[mark, other]
                    same = abs(gap) < CREASE * sample_q[mark, other]
                if same:
                    count += 1
                    sx += dx
                    sy += dy
                    faces[mark, other] = COUNTED
            if count == SAMPLES and (f == centre[r, c] or merge):
                break  # one surface only: the pixel stays unchanged
            sx, sy = sx / count, sy / count
            first[runs], face[runs], weight[runs] = runs, f, np.float32(count / SAMPLES)
            x[runs], y[runs] = tx[r, c] + sx * xx + sy * xy, ty[r, c] + sx * yx + sy * yy
            runs += 1
        mark += 1
    start[mark] = first[runs] = runs
    return runs, mark


@part
def _resolve(
    tile: TileMemory,
    begin: int,
    end: int,
    x0: int,
    y0: int,
    colour: F32,
    weight: F32,
    start: I32,
    radiance: F32,
) -> None:
    """Replace the radiance of the marks begin..end by the mean over their samples."""
    columns, rows = tile.mark, tile.mark_row
    for m in range(begin, end):
        if start[m] == start[m + 1]:
            continue
        for channel in range(colour.shape[1]):
            total = np.float32(0.0)
            for i in range(start[m], start[m + 1]):
                total += weight[i] * colour[i, channel]
            radiance[y0 + rows[m] - 1, x0 + columns[m] - 1, channel] = total


@kernel
def render_tiles(tiles: NDArray[np.int64], stage: TileInputs, target: TileOutputs) -> None:
    """Render the tiles of the given numbers (row by row from the top left): all pixels, then the edges."""
    camera, radiance = stage.camera, target.radiance
    columns = (camera.width + TILE_W - 1) // TILE_W
    tile, batch, items = new_tile(), new_batch(), new_items()
    colour = np.zeros((CAPACITY, radiance.shape[2]), np.float32)
    weight, start = np.zeros(CAPACITY, np.float32), np.zeros(CAPACITY + 1, np.int32)
    for index in tiles:
        x0, y0 = (index % columns) * TILE_W, (index // columns) * TILE_H
        width, height = min(TILE_W, camera.width - x0), min(TILE_H, camera.height - y0)
        runs = find_runs(tile, index, x0, y0, width, height, stage, batch)
        shade_runs(batch, runs, items, stage, colour)
        _store(batch, runs, x0, y0, width, height, stage, colour, target)
        marks = find_marks(tile, index, x0, y0, width, height, stage)
        begin = 0 * marks  # of the type of `marks`, so that what takes it is compiled once
        while begin < marks:
            runs, end = gather_marks(tile, begin, marks, stage, batch, weight, start)
            shade_runs(batch, runs, items, stage, colour)
            _resolve(tile, begin, end, x0, y0, colour, weight, start, radiance)
            begin = end
