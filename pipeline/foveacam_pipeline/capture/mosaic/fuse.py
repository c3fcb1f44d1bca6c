"""Fuses the depths of all pairs on one chart: the weighted mean of those that agree, without outliers."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.capture.mosaic.chart import Chart
from foveacam_pipeline.capture.mosaic.pair_depth import CellDepth
from foveacam_pipeline.capture.mosaic.values import DepthFigures

Cells = NDArray[np.float32]
BLOCK = 128
"""Side of a block, cells: memory does not depend on the number of pairs."""
AGREE_SIGMAS = 4.0
AGREE_SHARE = 0.003
"""Estimates agree within `AGREE_SIGMAS` of their errors plus this share of q, for unstated errors."""
SMOOTH_CELLS = 2.0
SPECKLE_CELLS = 300
SPECKLE_STEP = 0.02
"""Connected regions of fewer than `SPECKLE_CELLS` cells, neighbours within this share of depth, are noise."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FieldDepth:
    """Depth of a chart's cells: q = 1 / Z, 1/m, (rows, columns) float32, NaN unknown, and its standard error.

    `provisional`: q for rendering only: the known q, but beside a depth jump that of the nearer object.
    `filled`: q everywhere: a gap gets the nearest cell's q, smoothed.
    """

    per_depth: Cells
    sigma: Cells
    provisional: Cells
    filled: Cells
    figures: DepthFigures

    @property
    def z_m(self) -> Cells:
        """Depth along z, m, NaN unknown."""
        return np.asarray(1.0 / self.per_depth, dtype=np.float32)

    @property
    def sigma_m(self) -> Cells:
        """Its standard error, m."""
        return np.asarray(self.sigma / self.per_depth**2, dtype=np.float32)


@dataclass(slots=True)
class _FusionCounts:
    estimates: int = 0
    left_out: int = 0
    several: int = 0
    square: float = 0.0
    degrees: int = 0


def fuse(chart: Chart, patches: Sequence[CellDepth]) -> FieldDepth:
    """Return the depth of a chart from overlapping patches."""
    shape = chart.rows, chart.columns
    per_depth, sigma, edge = (np.full(shape, np.nan, dtype=np.float32) for _ in range(3))
    tally = _FusionCounts()
    for rows, columns in blocks(shape):
        layers = [
            crop_layers(patch, rows, columns) for patch in patches if overlaps_block(patch, rows, columns)
        ]
        if layers:
            block = np.array(layers)
            per_depth[rows, columns], sigma[rows, columns] = _consensus(block, tally)
            edge[rows, columns] = _median(block[:, 3])
    lone = speckle_mask(per_depth)
    tally.left_out += int(lone.sum())
    per_depth[lone], sigma[lone] = np.nan, np.nan
    known = np.isfinite(per_depth)
    figures = DepthFigures(
        known=float(known.mean()),
        seen_twice=tally.several / max(1, int(known.sum())),
        between_pairs_rel_rms=float(np.sqrt(tally.square / max(1, tally.degrees))),
        outliers=tally.left_out / max(1, tally.estimates),
        median_sigma_rel=float(np.median(sigma[known] / per_depth[known])) if known.any() else float("nan"),
    )
    provisional = np.where(known, per_depth, edge)
    provisional[speckle_mask(provisional)] = np.nan
    return FieldDepth(
        per_depth=per_depth,
        sigma=sigma,
        provisional=provisional,
        filled=fill_gaps(provisional),
        figures=figures,
    )


def fill_gaps(values: Cells) -> Cells:
    """Return (h, w) without NaN: gaps get the nearest cell's value, smoothed; zeros if no cell is known."""
    known = np.isfinite(values)
    if not known.any():
        return np.zeros_like(values)
    from scipy.ndimage import distance_transform_edt  # slow to import

    row, column = distance_transform_edt(~known, return_distances=False, return_indices=True)
    nearest = np.ascontiguousarray(values[row, column])
    return np.where(known, values, cv2.GaussianBlur(nearest, (0, 0), SMOOTH_CELLS)).astype(np.float32)


def blocks(shape: tuple[int, ...]) -> Iterator[tuple[slice, slice]]:
    """Yield rows and columns of the blocks that make up (rows, columns) of cells."""
    for top in range(0, shape[0], BLOCK):
        for left in range(0, shape[1], BLOCK):
            yield slice(top, min(shape[0], top + BLOCK)), slice(left, min(shape[1], left + BLOCK))


def overlaps_block(patch: CellDepth, rows: slice, columns: slice) -> bool:
    """Return whether a patch has cells in a block."""
    over = patch.rows.start < rows.stop and rows.start < patch.rows.stop
    return bool(over and patch.columns.start < columns.stop and columns.start < patch.columns.stop)


def crop_layers(patch: CellDepth, rows: slice, columns: slice) -> Cells:
    """Return (4, h, w): q, its matching error, the pose's, and q beside jumps; NaN outside the patch."""
    out = np.full((4, rows.stop - rows.start, columns.stop - columns.start), np.nan, dtype=np.float32)
    top, bottom = max(rows.start, patch.rows.start), min(rows.stop, patch.rows.stop)
    left, right = max(columns.start, patch.columns.start), min(columns.stop, patch.columns.stop)
    here = (slice(top - rows.start, bottom - rows.start), slice(left - columns.start, right - columns.start))
    there = (slice(top - patch.row, bottom - patch.row), slice(left - patch.column, right - patch.column))
    out[0][here], out[1][here] = patch.per_depth[there], patch.sigma[there]
    out[2][here], out[3][here] = patch.pose_sigma, patch.edge[there]
    return out


def _consensus(layers: Cells, tally: _FusionCounts) -> tuple[Cells, Cells]:
    """Return q and its error, (h, w), of the group with the most weight, where it has more than half."""
    q, own, pose = layers[:, 0], layers[:, 1], layers[:, 2]
    known = np.isfinite(q)
    variance = own**2 + pose**2
    weight = np.where(known, 1.0 / variance, 0.0)
    support = np.zeros_like(weight)
    groups = np.zeros((len(q), *q.shape), dtype=np.bool_)
    for k in range(len(q)):
        allowed = AGREE_SIGMAS * np.sqrt(variance + variance[k]) + AGREE_SHARE * np.abs(q[k])
        groups[k] = known & known[k] & (np.abs(q - q[k]) <= allowed)
        support[k] = np.sum(np.where(groups[k], weight, 0.0), axis=0)
    best = np.argmax(support, axis=0)
    group = np.take_along_axis(groups, best[None, None], axis=0)[0]
    total = np.sum(np.where(group, weight, 0.0), axis=0)
    sure = total > 0.5 * np.sum(weight, axis=0)
    group &= sure
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.sum(np.where(group, weight * q, 0.0), axis=0) / total
        matching = 1.0 / np.sum(np.where(group, 1.0 / own**2, 0.0), axis=0)
    shared = np.max(np.where(group, pose, 0.0), axis=0)
    _count(tally, q, known, group, mean)
    sigma = np.sqrt(matching + shared**2)
    return np.where(sure, mean, np.nan).astype(np.float32), np.where(sure, sigma, np.nan).astype(np.float32)


def _count(
    tally: _FusionCounts,
    q: Cells,
    known: NDArray[np.bool_],
    group: NDArray[np.bool_],
    mean: NDArray[np.floating],
) -> None:
    tally.estimates += int(known.sum())
    tally.left_out += int((known & ~group).sum())
    members = group.sum(axis=0)
    several = members > 1
    tally.several += int(several.sum())
    with np.errstate(invalid="ignore", divide="ignore"):
        apart = np.where(group, q / mean - 1.0, 0.0)
    tally.square += float(np.sum(np.where(several, np.sum(apart**2, axis=0), 0.0)))
    tally.degrees += int(np.sum(np.where(several, members - 1, 0)))


def _median(values: Cells) -> Cells:
    """Return the median over the first axis, NaN where there is none."""
    ordered = np.sort(values, axis=0)
    count = np.isfinite(values).sum(axis=0)
    chosen = np.maximum(count - 1, 0) // 2
    return np.asarray(np.take_along_axis(ordered, chosen[None], axis=0)[0], dtype=np.float32)


def speckle_mask(
    per_depth: Cells, *, cells: int = SPECKLE_CELLS, step_q: float | None = None
) -> NDArray[np.bool_]:
    """Return the known cells whose connected region is too small; steps of depth separate regions.

    `step_q`: size of such a step, 1/m; else `SPECKLE_STEP`, a share of the depth.
    """
    known = np.isfinite(per_depth)
    scaled = np.zeros(per_depth.shape, dtype=np.int16)
    values = np.log(per_depth[known]) / SPECKLE_STEP if step_q is None else per_depth[known] / step_q
    scaled[known] = np.clip(np.rint(values * 20.0), -16_000, 16_000) + 16_001
    before = scaled.copy()
    cv2.filterSpeckles(scaled, 0.0, cells, 20.0)
    return np.asarray((before != 0) & (scaled == 0))
