"""The renderer: images of a scene by projection, cached until something in view moves.

Frames consist of tiles at absolute positions, each a pure function of scene and projection; so the bits do
not depend on threads, on the region requested, or on earlier frames. Tiles run on a thread pool of the
renderer; kernels never submit to it.
"""

import threading
from collections import OrderedDict
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract.errors import InvalidInput
from foveacam_hardware.sim.render.binning import sort_into_tiles, tile_shifts
from foveacam_hardware.sim.render.frame_inputs import kernel_view, object_table, tile_inputs
from foveacam_hardware.sim.render.hiding import nearest_depths
from foveacam_hardware.sim.render.projection import Projection, RayTable, disparity_of
from foveacam_hardware.sim.render.scene import Scene, SceneSnapshot
from foveacam_hardware.sim.render.setup import (
    TILE_H,
    TILE_W,
    empty_corners,
    empty_prims,
    set_up,
)
from foveacam_hardware.sim.render.shade import CUT_HALVED_PX, CUT_PX
from foveacam_hardware.sim.render.tiles import TileInputs, TileOutputs, render_tiles

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]
I32 = NDArray[np.int32]
Bool = NDArray[np.bool_]
CACHED_FRAMES = 8
CACHED_LENSES = 4


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Radiance:
    """Radiance, depth and object numbers of an image, noiseless and sharp; arrays are read-only.

    Attributes:
        radiance: (h, w) or (h, w, 3) float32, linear, 0..1.
        depth_m: (h, w) float32 along the projection's `axis` (the scene's +z) from its centre, inf where
            nothing is hit; `Projection.range_m` turns it into a distance.
        ids: (h, w) int32, the object's number, −1 where nothing is hit.
    """

    radiance: F32
    depth_m: F32
    ids: I32


class _CachedFrame:
    """A cached frame: which of its tiles are valid, and the tiles that each object covered."""

    def __init__(self, projection: Projection, channels: int, tiles: int) -> None:
        shape = (projection.height, projection.width)
        self.target = TileOutputs(
            np.zeros((*shape, channels), np.float32), np.zeros(shape, np.float32), np.zeros(shape, np.int32)
        )
        self.lens = b"" if projection.rays is None else projection.rays.digest
        self.valid: Bool = np.zeros(tiles, bool)
        self.footprint: Bool = np.zeros((0, tiles), bool)
        self.revision = -1
        self.lent = False
        self.stage: TileInputs | None = None

    def invalidate(self, snapshot: SceneSnapshot, footprint: Bool) -> None:
        """Invalidate the tiles that any object moved since then covered, or covers now."""
        moved = np.flatnonzero(snapshot.moved > self.revision)
        before = moved[moved < len(self.footprint)]
        self.valid &= ~footprint[moved].any(axis=0) & ~self.footprint[before].any(axis=0)
        self.footprint, self.revision = footprint, snapshot.revision

    def empty(self, tiles: NDArray[np.int64]) -> None:
        """Clear tiles in which nothing is hit; they stay invalid."""
        columns = -(-self.target.depth.shape[1] // TILE_W)
        for row, column in zip(*np.divmod(tiles, columns), strict=True):
            here = (
                slice(row * TILE_H, (row + 1) * TILE_H),
                slice(column * TILE_W, (column + 1) * TILE_W),
            )
            self.target.depth[here], self.target.ids[here] = np.inf, -1

    def copy_lent(self) -> None:
        """Replace arrays that a caller may still hold by copies."""
        if self.lent:
            radiance, depth, ids = self.target
            self.target = TileOutputs(radiance.copy(), depth.copy(), ids.copy())
            self.lent = False


class Renderer:
    """Renders projections of one scene; any thread may call it, one frame is rendered at a time."""

    def __init__(self, scene: Scene, threads: int = 2, *, cached_frames: int = CACHED_FRAMES) -> None:
        if threads < 1 or cached_frames < 1:
            raise InvalidInput(
                f"renderer: threads = {threads}, cached_frames = {cached_frames}; both at least 1"
            )
        self.scene = scene
        self._threads = threads
        self._pool = ThreadPoolExecutor(threads, "render") if threads > 1 else None
        self._lock = threading.Lock()
        self._cached_frames = cached_frames
        self._frames: OrderedDict[tuple[bytes, int], _CachedFrame] = OrderedDict()
        self._lenses: OrderedDict[tuple[bytes, int, int], tuple[F32, F64]] = OrderedDict()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the pool's threads and drop every cached frame; no effect when closed."""
        with self._lock:
            self._frames.clear()
            pool, self._pool, self._threads = self._pool, None, 1
        if pool is not None:
            pool.shutdown(wait=True)

    def radiance(
        self, projection: Projection, roi: tuple[int, int, int, int] | None = None, channels: int = 1
    ) -> Radiance:
        """Render an image, or its part roi = (x, y, width, height); channels 1 = grey, 3 = RGB."""
        _check_channels(channels)
        return self._radiance(projection, roi, channels)

    def layer(self, projection: Projection, channels: int = 1) -> Radiance:
        """Render an image whose radiance has one more channel: the coverage of a pixel by objects, 0..1."""
        _check_channels(channels)
        return self._radiance(projection, None, channels + 1)

    def behind(self, projection: Projection, hiding_m: F64, channels: int = 1) -> Radiance:
        """Render an image except where a layer in front hides it; the depth there is infinite.

        `hiding_m`: depth beyond which each tile is hidden, from `hiding_depths`.
        """
        _check_channels(channels)
        return self._radiance(projection, None, channels, hiding_m=hiding_m)

    def _radiance(
        self,
        projection: Projection,
        roi: tuple[int, int, int, int] | None,
        channels: int,
        *,
        hiding_m: F64 | None = None,
    ) -> Radiance:
        x, y, w, h = _checked_roi(roi, projection)
        with self._lock:
            entry = self._entry(projection, channels)
            self._complete(entry, _tiles_of(x, y, w, h, projection.width), hiding_m)
            whole = (w, h) == (projection.width, projection.height)
            entry.lent = entry.lent or whole
            here = (slice(y, y + h), slice(x, x + w))
            radiance, depth, ids = (
                entry.target.radiance[here],
                entry.target.depth[here],
                entry.target.ids[here],
            )
            if not whole:
                radiance, depth, ids = radiance.copy(), depth.copy(), ids.copy()
        for part in (radiance, depth, ids):
            part.flags.writeable = False
        return Radiance(radiance=radiance[..., 0] if channels == 1 else radiance, depth_m=depth, ids=ids)

    def disparity(self, left: Projection, right: Projection) -> tuple[F32, Bool]:
        """Return x_left − x_right, (h, w) px of the left image, and the mask of points visible in both."""
        a, b = self.radiance(left), self.radiance(right)
        return disparity_of(left, a.depth_m, a.ids, right, b.depth_m, b.ids)

    def _entry(self, projection: Projection, channels: int) -> _CachedFrame:
        """Return the cached frame of a projection, its outdated tiles invalidated."""
        key = (projection.key, channels)
        entry = self._frames.pop(key, None)
        snapshot = self.scene.snapshot()
        if entry is None:
            tiles = -(-projection.width // TILE_W) * -(-projection.height // TILE_H)
            entry = _CachedFrame(projection, channels, tiles)
        self._frames[key] = entry
        if len(self._frames) > self._cached_frames:
            self._drop_oldest(key, entry)
        if entry.revision != snapshot.revision:
            entry.stage, footprint = self._stage(snapshot, projection, channels)
            entry.invalidate(snapshot, footprint)
        return entry

    def _drop_oldest(self, key: tuple[bytes, int], entry: _CachedFrame) -> None:
        """Evict the least recently used frame of the entry's lens; if it has none, that of any lens.

        A moving mirror, whose exposure takes several projections, drops no frame of the wide camera.
        """
        others = (old for old, frame in self._frames.items() if frame.lens == entry.lens and old != key)
        del self._frames[next(others, next(iter(self._frames)))]

    def _complete(self, entry: _CachedFrame, requested: NDArray[np.int64], hiding_m: F64 | None) -> None:
        """Render those of the requested tiles that are not valid, and not hidden."""
        tiles = requested[~entry.valid[requested]]
        if len(tiles) == 0 or entry.stage is None:
            return
        entry.copy_lent()
        if hiding_m is not None:
            some = tiles[np.isfinite(hiding_m[tiles])]
            hidden = some[nearest_depths(entry.stage, some) > hiding_m[some]]
            entry.empty(hidden)
            tiles = np.setdiff1d(tiles, hidden)
        self._render(tiles, entry.stage, entry.target)
        entry.valid[tiles] = True

    def _render(self, tiles: NDArray[np.int64], stage: TileInputs, target: TileOutputs) -> None:
        if self._pool is None or len(tiles) < 8:
            render_tiles(tiles, stage, target)
            return
        bands: Sequence[NDArray[np.int64]] = np.array_split(tiles, min(len(tiles) // 4, 16 * self._threads))
        for work in [self._pool.submit(render_tiles, band, stage, target) for band in bands]:
            work.result()

    def _stage(
        self, snapshot: SceneSnapshot, projection: Projection, channels: int
    ) -> tuple[TileInputs, Bool]:
        """Set a frame up; return also which tiles may show each object, (objects, tiles)."""
        view = kernel_view(projection, *self._lens(projection.rays, projection.width, projection.height))
        objects = object_table(snapshot, projection, view)
        prims = empty_prims(len(snapshot.geometry.faces))
        corners = empty_corners(len(snapshot.geometry.vertices))
        count = set_up(snapshot.geometry, objects, snapshot.ambient, view, corners, prims)
        footprint = np.zeros((len(snapshot.poses), len(view.tile_shift) - 1), bool)
        bins = sort_into_tiles(prims, count, view, footprint)
        cut_px = CUT_PX if projection.halvings == 0 else CUT_HALVED_PX
        return tile_inputs(snapshot, view, objects, prims, bins, channels=channels, cut_px=cut_px), footprint

    def _lens(self, rays: RayTable | None, width: int, height: int) -> tuple[F32, F64]:
        key = (b"" if rays is None else rays.digest, width, height)
        lens = self._lenses.pop(key, None)
        if lens is None:
            shift = np.zeros((1, 1, 2), np.float32) if rays is None else rays.shift_px
            shift.flags.writeable = False
            lens = (shift, tile_shifts(shift, width, height))
        self._lenses[key] = lens
        while len(self._lenses) > CACHED_LENSES:
            self._lenses.popitem(last=False)
        return lens


def _check_channels(channels: int) -> None:
    if channels not in (1, 3):
        raise InvalidInput(f"channels = {channels}; pass 1 (grey) or 3 (RGB)")


def _checked_roi(roi: tuple[int, int, int, int] | None, projection: Projection) -> tuple[int, int, int, int]:
    size = (projection.width, projection.height)
    if roi is None:
        return 0, 0, *size
    x, y, w, h = roi
    if w < 1 or h < 1 or x < 0 or y < 0 or x + w > size[0] or y + h > size[1]:
        raise InvalidInput(f"roi {roi} (x, y, width, height) does not lie in the {size[0]}x{size[1]} image")
    return roi


def _tiles_of(x: int, y: int, w: int, h: int, width: int) -> NDArray[np.int64]:
    """Return the numbers of the tiles that a rectangle touches, ascending."""
    columns = np.arange(x // TILE_W, (x + w - 1) // TILE_W + 1)
    rows = np.arange(y // TILE_H, (y + h - 1) // TILE_H + 1)
    tiles: NDArray[np.int64] = (rows[:, None] * -(-width // TILE_W) + columns).ravel().astype(np.int64)
    return tiles
