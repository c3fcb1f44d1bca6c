"""Depth of the wide view on a grid, for one calibration: fused, ageing, forgotten when the scene changes."""

import math
import threading
import time
from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.context.changes import BLOCKS, block_means, changed_cells, noise_per_level
from foveacam_pipeline.context.fusing import fuse_surfaces
from foveacam_pipeline.context.surfaces import cell_surfaces
from foveacam_pipeline.context.values import AgeingModel, ContextMap, DepthSource
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.verge.depth_samples import DepthSamples

CELL_PX = 8
FORGET_AFTER_S = 5.0
"""A cell that has looked different for so long has lost its depth; until then its depth is withheld: a person
who walks past leaves the room as it was."""
ALL_CHANGED_SHARE = 0.6
"""When so many of the known cells look different at once, the rig or the whole scene has moved."""
MANY_CELLS = 50
"""Fewer known cells say nothing of the scene as a whole."""


class WideContext:
    """Depth of the wide view on a grid of square cells; safe to be used by several threads.

    A `DepthContext`. Bound to one calibration and one pose of the rig: whoever holds it takes a new one, or
    calls `clear`, when either changes.
    """

    def __init__(
        self,
        wide: Intrinsics,
        *,
        cell_px: int = CELL_PX,
        now_s: Callable[[], float] = time.time,
        ageing: AgeingModel | None = None,
    ) -> None:
        """`now_s` returns seconds since 1970: ages count through a restart."""
        self.wide = wide
        self.rows, self.columns = -(-wide.height // cell_px), -(-wide.width // cell_px)
        self.ageing = ageing or AgeingModel()
        self._now_s = now_s
        self._lock = threading.Lock()
        self._map = ContextMap.empty(rows=self.rows, columns=self.columns, cell_px=cell_px)
        self._reference = np.full((BLOCKS * self.rows, BLOCKS * self.columns), np.nan, dtype=np.float32)
        self._changed_since_s = np.full((self.rows, self.columns), np.nan)
        self._all_changed_since_s = math.inf
        self._noise: float | None = None
        self._revision = 0

    @property
    def cell_px(self) -> int:
        """Side of a cell, wide px."""
        return self._map.cell_px

    @property
    def revision(self) -> int:
        """A number that rises whenever the known depth changes."""
        with self._lock:
            return self._revision

    def fuse(
        self, samples: DepthSamples, *, source: DepthSource, gray: NDArray[np.uint8] | None = None
    ) -> int:
        """Take measured points; return how many cells they reached.

        `gray`: the wide image of the moment of the measurement, (h, w) uint8; with it, a later change of the
        scene is noticed.
        """
        cell = self._cells(samples.tangents)
        usable = (cell >= 0) & (samples.inverse_z_per_m > 0.0) & np.isfinite(samples.sigma_per_m)
        measured = samples.only(usable)
        surfaces = cell_surfaces(measured, cell[usable])
        if len(surfaces) == 0:
            return 0
        means = None if gray is None else block_means(gray, cell_px=self.cell_px)
        touched = np.unique(surfaces.cell)
        with self._lock:
            fuse_surfaces(self._map, surfaces, source=source, now_s=self._now_s(), ageing=self.ageing)
            self._changed_since_s.reshape(-1)[touched] = np.nan
            self._refer(touched, means)
            self._revision += 1
        return len(touched)

    def see(self, gray: NDArray[np.uint8]) -> int:
        """Compare a new wide image with what the cells looked like; return how many lost their depth.

        A changed cell is withheld at once and forgotten `FORGET_AFTER_S` later unless it looks as before.
        """
        means = block_means(gray, cell_px=self.cell_px)
        if self._noise is None:
            self._noise = noise_per_level(gray)
        now_s = self._now_s()
        with self._lock:
            known = self._map.known.any(axis=0)
            changed = known & changed_cells(self._reference, means, noise=self._noise, cell_px=self.cell_px)
            all_changed = known.sum() >= MANY_CELLS and changed.sum() > ALL_CHANGED_SHARE * known.sum()
            self._all_changed_since_s = min(self._all_changed_since_s, now_s) if all_changed else math.inf
            beside = cv2.dilate(changed.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(np.bool_) & known
            before = np.isfinite(self._changed_since_s)
            self._changed_since_s[~beside] = np.nan
            self._changed_since_s[beside & ~before] = now_s
            gone = beside & (now_s - self._changed_since_s >= FORGET_AFTER_S)
            if now_s - self._all_changed_since_s >= FORGET_AFTER_S:
                gone |= known
            self._forget(gone)
            if gone.any() or bool((beside != before).any()):
                self._revision += 1
            return int(gone.sum())

    def around(self, target: NDArray[np.float64], *, reach_tan: float) -> DepthSamples:
        """Return the samples within `reach_tan` (tangent units) of a direction: (2,) tangents."""
        return self.samples().near(target, reach_tan=reach_tan)

    def samples(self) -> DepthSamples:
        """Return every surface that is known and not withheld, errors grown with age."""
        known_map = self.snapshot()
        known = known_map.known
        return DepthSamples(
            tangents=known_map.tangents[known],
            inverse_z_per_m=known_map.inverse_z_per_m[known],
            sigma_per_m=known_map.sigma_per_m[known],
        )

    def snapshot(self, *, aged: bool = True) -> ContextMap:
        """Return a copy without what is withheld, with errors grown with age; as stored without `aged`."""
        with self._lock:
            copy, withheld = self._map.copy(), np.isfinite(self._changed_since_s)
        if not aged:
            return copy
        copy.forget(withheld)
        copy.sigma_per_m[:] = self.ageing.sigma_per_m(
            copy.sigma_per_m,
            inverse_z_per_m=copy.inverse_z_per_m,
            age_s=self._now_s() - copy.measured_s,
        )
        return copy

    def reference(self) -> NDArray[np.float32]:
        """Return (2 rows, 2 columns) float32, what the cells looked like when measured; NaN unknown."""
        with self._lock:
            return self._reference.copy()

    def restore(self, stored: ContextMap, *, reference: NDArray[np.float32]) -> None:
        """Take the place of everything known; `stored` has this context's grid."""
        with self._lock:
            self._map = stored.copy()
            self._reference = reference.copy()
            self._changed_since_s[:] = np.nan
            self._revision += 1

    def clear(self) -> None:
        """Forget everything: the rig has moved, or somebody asks for it."""
        with self._lock:
            self._forget(np.ones((self.rows, self.columns), dtype=np.bool_))
            self._revision += 1

    def _forget(self, cells: NDArray[np.bool_]) -> None:
        self._map.forget(cells)
        self._changed_since_s[cells] = np.nan
        blocks = np.repeat(np.repeat(cells, BLOCKS, axis=0), BLOCKS, axis=1)
        self._reference[blocks] = np.nan

    def _refer(self, touched: NDArray[np.int64], means: NDArray[np.float32] | None) -> None:
        cells = np.zeros(self.rows * self.columns, dtype=np.bool_)
        cells[touched] = True
        blocks = cells.reshape(self.rows, self.columns).repeat(BLOCKS, axis=0).repeat(BLOCKS, axis=1)
        self._reference[blocks] = np.nan if means is None else means[blocks]

    def _cells(self, tangents: NDArray[np.float64]) -> NDArray[np.int64]:
        """Return (n,) the flat index of the cell of each direction, -1 outside the wide image."""
        if len(tangents) == 0:
            return np.empty(0, dtype=np.int64)
        pixels = self.wide.pixels(np.arctan(tangents))
        column, row = np.floor((pixels.T + 0.5) / self.cell_px).astype(np.int64)
        inside = (column >= 0) & (row >= 0) & (column < self.columns) & (row < self.rows)
        return np.where(inside, row * self.columns + column, -1)
