"""The field of attention: cells of the wide view, and what is known of each.

A cell holds 3 x 3 cells of the wide context, whose depths it keeps apart: half a known cell is half known.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.geometry.angles import tan_from_angles
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.wide_depth.values import ContextMap

PARTS = 3
"""Context cells along each side of a cell."""
FIRST_GUESS_PER_M = 0.15
"""1/Z assumed while nothing is known, 1/m."""

BLANKEST, MOST_NOISE = 0.1, 0.35
"""Quantile of the cells that count as blank, and the largest slope of noise, grey levels per px."""
LEARNED, MOST_YIELD = 0.2, 1.5
"""Weight of the newest look in `Yields`, and the largest share that one look counts as."""

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FieldGrid:
    """The cells, row by row. `tangents`: (n, 2) float64, X/Z and Y/Z of their middles, rig frame."""

    rows: int
    columns: int
    cell_px: int
    """Side of a cell, px of the wide sensor."""
    tangents: Floats

    @classmethod
    def of(cls, wide: Intrinsics, *, context_cell_px: int) -> "FieldGrid":
        """Return the grid over a wide view whose context has cells of `context_cell_px`."""
        side = PARTS * context_cell_px
        rows, columns = -(-wide.height // side), -(-wide.width // side)
        x, y = np.meshgrid(np.arange(columns), np.arange(rows))
        middles = np.column_stack([x.ravel(), y.ravel()]) * side + (side - 1) / 2.0
        inside = np.minimum(middles, [wide.width - 1.0, wide.height - 1.0])
        return cls(
            rows=rows, columns=columns, cell_px=side, tangents=tan_from_angles(wide.angles_rad(inside))
        )

    def __len__(self) -> int:
        return self.rows * self.columns


@dataclass(frozen=True, slots=True, kw_only=True)
class Yields:
    """Shares of the expected worth that looks brought: of the eyes apart, and of both on one point."""

    apart: float = 1.0
    verged: float = 1.0

    def learned(self, *, apart: bool, share: float) -> "Yields":
        """Return the shares after one more look."""
        share = float(np.clip(share, 0.0, MOST_YIELD))
        if apart:
            return replace(self, apart=self.apart + LEARNED * (share - self.apart))
        return replace(self, verged=self.verged + LEARNED * (share - self.verged))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FieldState:
    """What is known of each of the n cells.

    `inverse_z_per_m`: (n,), 1/m, from neighbours where nothing is known; `guessed`: (n,) bool, where it is
    so. `relative_sigma`: (n, 9) error over distance of its parts, infinite where unknown. `contrast`: (n,)
    root mean square slope of the wide picture, grey levels per px. `looked_s`: (n,) time of the last look,
    -inf for none. `tries`: (n,) looks in a row that did not improve it. `yields`: what recent looks brought,
    as a share of what was expected.
    """

    now_s: float
    inverse_z_per_m: Floats
    guessed: Bools
    relative_sigma: Floats
    contrast: Floats
    looked_s: Floats
    tries: NDArray[np.int64]
    yields: "Yields"


def parts_of(values: NDArray[np.generic], grid: FieldGrid, *, fill: float) -> Floats:
    """Return (n, 9) the values of a context map's (rows, columns), by cell; `fill` beyond its edge."""
    rows, columns = values.shape
    below, beside = PARTS * grid.rows - rows, PARTS * grid.columns - columns
    whole = np.pad(values.astype(np.float64), ((0, below), (0, beside)), constant_values=fill)
    blocks = whole.reshape(grid.rows, PARTS, grid.columns, PARTS).swapaxes(1, 2)
    return blocks.reshape(len(grid), PARTS * PARTS)


def expected_inverse_z(known: ContextMap, grid: FieldGrid) -> tuple[Floats, Bools]:
    """Return (n,) 1/Z of each cell, that of the nearest known one where it has none, and (n,) where."""
    parts = parts_of(known.inverse_z_per_m[0], grid, fill=np.nan)
    found: Bools = np.asarray(np.isfinite(parts).any(axis=1))
    if not found.any():
        return np.full(len(grid), FIRST_GUESS_PER_M), ~found
    middle = np.maximum(np.isfinite(parts).sum(axis=1) - 1, 0) // 2
    median = np.take_along_axis(np.sort(parts, axis=1), middle[:, None], axis=1)[:, 0]  # NaN sorts last
    unknown = (~found).astype(np.uint8).reshape(grid.rows, grid.columns)
    _, labels = cv2.distanceTransformWithLabels(unknown, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    by_label = np.zeros(int(labels.max()) + 1, dtype=np.int64)
    by_label[labels.ravel()[found]] = np.flatnonzero(found)
    return np.asarray(median[by_label[labels.ravel()]], dtype=np.float64), ~found


def cell_contrast(gray: NDArray[np.uint8], grid: FieldGrid, *, binning: int) -> Floats:
    """Return (n,) root mean square slope along x of a wide picture, (h, w) uint8, grey levels per sensor px.

    The foveae are matched along x: what varies along y alone does not help. The camera's noise is taken out,
    which is what the blankest cells show, up to `MOST_NOISE`.
    """
    slope = cv2.Sobel(cv2.GaussianBlur(gray, (0, 0), 1.0), cv2.CV_32F, 1, 0, scale=1.0 / (8.0 * binning))
    side = grid.cell_px // binning
    below, beside = side * grid.rows - gray.shape[0], side * grid.columns - gray.shape[1]
    whole = cv2.copyMakeBorder(slope * slope, 0, max(0, below), 0, max(0, beside), cv2.BORDER_REPLICATE)
    mean = cv2.resize(whole, (grid.columns, grid.rows), interpolation=cv2.INTER_AREA)
    energy = np.asarray(mean, dtype=np.float64).ravel()
    noise = min(float(np.quantile(energy, BLANKEST)), MOST_NOISE**2)
    return np.sqrt(np.maximum(0.0, energy - noise))
