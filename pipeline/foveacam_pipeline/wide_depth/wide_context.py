"""The depth of the wide view on a grid of cells, for one calibration.

Measured depths are fused, their errors grow with age, and a cell loses its depth when it looks different: a
2 x 2 block of it changes its mean brightness by more than noise, quantisation and a common change of the
light explain.
"""

import math
import threading
import time
from collections.abc import Callable
from typing import get_args

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Binning
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.verge.matching.texture import LEAST_VARIANCE, noise_level
from foveacam_pipeline.verge.surroundings.depth_samples import DepthSamples
from foveacam_pipeline.wide_depth.fusing import fuse_surfaces
from foveacam_pipeline.wide_depth.surfaces import cell_surfaces
from foveacam_pipeline.wide_depth.values import AgeingModel, ContextMap, DepthSource

CELL_PX = 8
FORGET_AFTER_S = 5.0
"""A cell that looks different for this long loses its depth. Until then the depth is only withheld, because a
person who walks past leaves the room as it was."""
ALL_CHANGED_SHARE = 0.6
"""When this share of the known cells looks different at once, the rig or the whole scene has moved."""
MANY_CELLS = 50
"""Least number of known cells from which a movement of the whole scene is concluded."""
BLOCKS = 2
"""Number of blocks along each side of a cell."""
LEAST_CHANGE = 6.0
"""Smallest change of a block's mean, in standard deviations of its noise."""
LEAST_SHARE = 0.04
"""Smallest change of a block's mean as a share of its brightness, because exposure and shading vary."""
CLIPPED = (4.0, 250.0)
"""Block means outside these grey levels do not count for the common gain."""


class WideContext:
    """The depth of the wide view on a grid of square cells; thread-safe. Implements `DepthContext`.

    It belongs to one calibration and one pose of the rig: when either changes, its owner makes a new one or
    calls `clear`.
    """

    def __init__(
        self,
        wide: Intrinsics,
        *,
        cell_px: int = CELL_PX,
        now_s: Callable[[], float] = time.time,
        ageing: AgeingModel | None = None,
    ) -> None:
        """`now_s` returns seconds since 1970, so that ages go on counting across a restart."""
        self.wide = wide
        self.rows, self.columns = -(-wide.height // cell_px), -(-wide.width // cell_px)
        self.ageing = ageing or AgeingModel()
        self._now_s = now_s
        self._lock = threading.Lock()
        self._map = ContextMap.empty(rows=self.rows, columns=self.columns, cell_px=cell_px)
        blocks = BLOCKS * self.rows, BLOCKS * self.columns
        # One for each binning: the means of fine texture differ between binnings by more than noise.
        self._references: dict[Binning, NDArray[np.float32]] = {
            binning: np.full(blocks, np.nan, dtype=np.float32) for binning in get_args(Binning)
        }
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
        """A number that grows whenever the known depth changes."""
        with self._lock:
            return self._revision

    def fuse(
        self, samples: DepthSamples, *, source: DepthSource, gray: NDArray[np.uint8] | None = None
    ) -> int:
        """Fuse measured points into the grid; return the number of cells that changed.

        `gray`: (h, w) uint8, the wide image at the time of the measurement, binned or not; later changes of
        the scene are detected against it, and not at all without it.
        """
        cell = self._cells(samples.tangents)
        usable = (cell >= 0) & (samples.inverse_z_per_m > 0.0) & np.isfinite(samples.sigma_per_m)
        measured = samples.only(usable)
        surfaces = cell_surfaces(measured, cell[usable])
        if len(surfaces) == 0:
            return 0
        means = None if gray is None else self._block_means(gray)
        touched = np.unique(surfaces.cell)
        with self._lock:
            fuse_surfaces(self._map, surfaces, source=source, now_s=self._now_s(), ageing=self.ageing)
            self._changed_since_s.reshape(-1)[touched] = np.nan
            self._set_references(touched, means, None if gray is None else self.wide.binning_of(gray.shape))
            self._revision += 1
        return len(touched)

    def detect_changes(self, gray: NDArray[np.uint8]) -> int:
        """Compare a new wide image with the reference of each cell; return how many cells lost their depth.

        A changed cell is withheld at once and forgotten `FORGET_AFTER_S` later unless it looks as before.
        `gray`: (h, w) uint8.
        """
        means, binning = self._block_means(gray), self.wide.binning_of(gray.shape)
        if self._noise is None:
            self._noise = binning**2 * noise_per_level(gray)
        now_s = self._now_s()
        with self._lock:
            known = self._map.known.any(axis=0)
            reference = self._reference_at(binning, means)
            changed = known & changed_cells(
                reference, means, noise=self._noise, cell_px=self.cell_px, binning=binning
            )
            all_changed = known.sum() >= MANY_CELLS and changed.sum() > ALL_CHANGED_SHARE * known.sum()
            self._all_changed_since_s = min(self._all_changed_since_s, now_s) if all_changed else math.inf
            beside = cv2.dilate(changed.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(np.bool_) & known
            before = np.isfinite(self._changed_since_s)
            self._changed_since_s[~beside] = np.nan
            self._changed_since_s[beside & ~before] = now_s
            lost = beside & (now_s - self._changed_since_s >= FORGET_AFTER_S)
            if now_s - self._all_changed_since_s >= FORGET_AFTER_S:
                lost |= known
            self._forget(lost)
            if lost.any() or bool((beside != before).any()):
                self._revision += 1
            return int(lost.sum())

    def _block_means(self, gray: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Return the block means of a wide image, which may be binned."""
        cell_px = self.cell_px // self.wide.binning_of(gray.shape)
        return block_means(gray, cell_px=cell_px, rows=self.rows, columns=self.columns)

    def around(self, target: NDArray[np.float64], *, reach_tan: float) -> DepthSamples:
        """Return the samples within `reach_tan` (tangent units) of a direction: (2,) tangents."""
        return self.samples().near(target, reach_tan=reach_tan)

    def samples(self) -> DepthSamples:
        """Return every known surface that is not withheld; the standard errors include ageing."""
        known_map = self.snapshot()
        known = known_map.known
        return DepthSamples(
            tangents=known_map.tangents[known],
            inverse_z_per_m=known_map.inverse_z_per_m[known],
            sigma_per_m=known_map.sigma_per_m[known],
        )

    def snapshot(self, *, aged: bool = True) -> ContextMap:
        """Return a copy of the map, withheld cells removed and errors aged; as stored if not `aged`."""
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

    def reference(self) -> tuple[Binning, NDArray[np.float32]]:
        """Return the cells' block means when they were measured, and the binning of those pictures.

        (2 rows, 2 columns) float32, NaN unknown; of the binning at which most cells were seen.
        """
        with self._lock:
            binning = max(self._references, key=lambda each: np.isfinite(self._references[each]).sum())
            return binning, self._references[binning].copy()

    def restore(self, stored: ContextMap, *, reference: NDArray[np.float32], binning: Binning) -> None:
        """Replace the whole content by `stored`, which has this context's grid; `binning`: of `reference`."""
        with self._lock:
            self._map = stored.copy()
            for each, means in self._references.items():
                means[:] = reference if each == binning else np.nan
            self._changed_since_s[:] = np.nan
            self._revision += 1

    def clear(self) -> None:
        """Forget all depth, because the rig has moved or a user asks for it."""
        with self._lock:
            self._forget(np.ones((self.rows, self.columns), dtype=np.bool_))
            self._revision += 1

    def _forget(self, cells: NDArray[np.bool_]) -> None:
        self._map.forget(cells)
        self._changed_since_s[cells] = np.nan
        for reference in self._references.values():
            reference[_blocks(cells)] = np.nan

    def _set_references(
        self, touched: NDArray[np.int64], means: NDArray[np.float32] | None, binning: Binning | None
    ) -> None:
        cells = np.zeros(self.rows * self.columns, dtype=np.bool_)
        cells[touched] = True
        blocks = _blocks(cells.reshape(self.rows, self.columns))
        for each, reference in self._references.items():
            reference[blocks] = means[blocks] if means is not None and each == binning else np.nan

    def _reference_at(self, binning: Binning, means: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the reference at a binning.

        What was seen at the other one alone begins with this picture's means, unless it differs now.
        """
        reference = self._references[binning]
        seen = np.any([np.isfinite(each) for each in self._references.values()], axis=0)
        first = seen & np.isnan(reference) & ~_blocks(np.isfinite(self._changed_since_s))
        reference[first] = means[first]
        return reference

    def _cells(self, tangents: NDArray[np.float64]) -> NDArray[np.int64]:
        """Return (n,) the flat cell index of each direction, -1 outside the wide image."""
        if len(tangents) == 0:
            return np.empty(0, dtype=np.int64)
        pixels = self.wide.pixels(np.arctan(tangents))
        column, row = np.floor((pixels.T + 0.5) / self.cell_px).astype(np.int64)
        inside = (column >= 0) & (row >= 0) & (column < self.columns) & (row < self.rows)
        return np.where(inside, row * self.columns + column, -1)


def _blocks(cells: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which blocks belong to these cells."""
    return np.repeat(np.repeat(cells, BLOCKS, axis=0), BLOCKS, axis=1)


def block_means(gray: NDArray[np.uint8], *, cell_px: int, rows: int, columns: int) -> NDArray[np.float32]:
    """Return (2 rows, 2 columns) float32, the mean grey level of each block of the grid's cells.

    Cells that the image covers only in part are completed by repeating the image's border.
    """
    height, width = gray.shape
    below, beside = rows * cell_px - height, columns * cell_px - width
    whole = cv2.copyMakeBorder(gray, 0, below, 0, beside, cv2.BORDER_REPLICATE) if below or beside else gray
    size = (BLOCKS * columns, BLOCKS * rows)
    means = cv2.resize(whole.astype(np.float32), size, interpolation=cv2.INTER_AREA)
    return np.asarray(means, dtype=np.float32)


def noise_per_level(gray: NDArray[np.uint8]) -> float:
    """Return the variance of the brightness noise per grey level of brightness."""
    height, width = gray.shape
    around = np.array([width / 2, height / 2])
    level = max(
        1.0, float(gray[height // 2 - 16 : height // 2 + 17, width // 2 - 16 : width // 2 + 17].mean())
    )
    return max(0.0, (noise_level(gray, at_px=around) ** 2 - LEAST_VARIANCE) / level)


def changed_cells(
    reference: NDArray[np.float32],
    now: NDArray[np.float32],
    *,
    noise: float,
    cell_px: int,
    binning: Binning = 1,
) -> NDArray[np.bool_]:
    """Return (rows, columns) bool: the cells with a changed block. NaN in `reference` counts as unchanged.

    `noise`: variance per grey level of one px of the sensor. `binning`: of the images, whose larger pixels
    were rounded to whole grey levels. A factor common to all brightness is not a change.
    """
    clear = np.isfinite(reference) & (reference > CLIPPED[0]) & (reference < CLIPPED[1]) & (now < CLIPPED[1])
    gain = float(np.median(now[clear] / reference[clear])) if clear.any() else 1.0
    expected = np.minimum(gain * reference, 255.0)
    pixels = (cell_px / BLOCKS) ** 2
    variance = 2.0 * (binning**2 * LEAST_VARIANCE + noise * np.maximum(expected, 1.0)) / pixels
    limit = np.hypot(LEAST_CHANGE * np.sqrt(variance), LEAST_SHARE * expected)
    changed = np.abs(now - expected) > limit  # NaN compares as unchanged
    rows, columns = changed.shape
    cells = changed.reshape(rows // BLOCKS, BLOCKS, columns // BLOCKS, BLOCKS).any(axis=(1, 3))
    return np.asarray(cells, dtype=np.bool_)
