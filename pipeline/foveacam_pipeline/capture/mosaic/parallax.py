"""Depth from the overlaps of one eye's views, for rendering where stereo has none.

The pupil moves with the mirror, a few millimetres from view to view: neighbouring views of one eye have a
baseline along that motion, and form a rectified pair. It is too short for a depth worth storing, but
sufficient for seams: they need the depth at which both views show a point at the same position. Every overlap
is matched completely, so that each cell beside a depth jump is on the right side.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.capture.mosaic.chart import CELL, Chart
from foveacam_pipeline.capture.mosaic.fuse import (
    Cells,
    FieldDepth,
    blocks,
    crop_layers,
    fill_gaps,
    overlaps_block,
    speckle_mask,
)
from foveacam_pipeline.capture.mosaic.look import EyeLook
from foveacam_pipeline.capture.mosaic.pair_depth import CellDepth
from foveacam_pipeline.capture.mosaic.views import Floats, MosaicView, Picture, ViewPictureCache
from foveacam_pipeline.stereo.match import gray, match
from foveacam_pipeline.stereo.rectify import EDGE_PX
from foveacam_pipeline.stereo.search import MatchSettings
from foveacam_pipeline.stereo.values import DisparityMap, RectifiedPair

NEAREST_M, FARTHEST_M = 0.8, 1e4
"""Range of depths that are searched."""
STEP_PX = 2.0
"""Chart px per px of the matched images: finer detail than the optics' blur is not needed."""
LEAST_PX_M = 6.0
"""Least motion of a point with q = 1 / Z, px m: a match error of 0.1 px is then 0.02 per metre."""
LEAST_OVERLAP_PX = 60.0
POSE_SIGMA_PX = 0.15
"""Pointing error between two looks with one calibration, px, common to all cells of an overlap."""
LEAST_SAMPLES = 4
"""Least number of matched px of the 16 px of a cell."""
SPECKLE_CELLS, SPECKLE_Q = 20, 0.02
"""Connected regions of fewer than `SPECKLE_CELLS` cells, neighbours within this q, 1/m, are noise."""
SMOOTH_CELLS = 5
"""Window of the median over cells, which preserves jumps."""
SETTINGS = MatchSettings(near_m=NEAREST_M, far_m=FARTHEST_M, speckle_px=60, max_sigma_px=0.45)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OverlapStrip:
    """An overlap as a rectified pair: `baseline_m` is 1, `f_px` the motion of a point with q.

    `places_px`: (2, h, w), plane positions of its pixels for objects at infinity. `along`: (2,), unit, the
    direction of the motion: a nearer object lies further along it in the first view.
    """

    pair: RectifiedPair
    places_px: Floats
    along: Floats


def add_overlap_depth(
    depth: FieldDepth, views: Sequence[MosaicView], pictures: ViewPictureCache, *, chart: Chart
) -> Iterator[tuple[int, FieldDepth]]:
    """Yield (views done, depth so far); the last depth includes that of overlaps without stereo."""
    patches: list[CellDepth] = []
    halves: dict[int, Picture] = {}
    for first, view in enumerate(views):
        halves = {number: half for number, half in halves.items() if number >= first}
        for second in range(first + 1, len(views)):
            if _overlap(view, views[second]):
                for number in {first, second} - halves.keys():
                    halves[number] = _half_size(pictures.picture(views[number]))
                looks = view.look, views[second].look
                cells = overlap_cells(looks, (halves[first], halves[second]), chart)
                patches += [cells] if cells is not None else []
        if first + 1 < len(views):
            yield first + 1, depth
    overlap_q = _weighted_medians(chart, patches)
    overlap_q[speckle_mask(overlap_q, cells=SPECKLE_CELLS, step_q=SPECKLE_Q)] = np.nan
    overlap_q = np.where(np.isfinite(overlap_q), cv2.medianBlur(fill_gaps(overlap_q), SMOOTH_CELLS), np.nan)
    provisional = np.where(np.isfinite(depth.per_depth), depth.per_depth, overlap_q)
    provisional = np.where(np.isfinite(provisional), provisional, depth.provisional)
    yield len(views), replace(depth, provisional=provisional, filled=fill_gaps(provisional))


def overlap_cells(
    looks: tuple[EyeLook, EyeLook], halves: tuple[Picture, Picture], chart: Chart
) -> CellDepth | None:
    """Return the depth from the overlap of two views of one eye; None where there is none.

    `halves`: their pictures, (h, w) uint8, at half the size.
    """
    strip = overlap_strip(*looks, halves)
    if strip is None:
        return None
    found = match(strip.pair, SETTINGS)
    places_px, per_depth, sigma = _triangulate(strip, found, *looks)
    pose_sigma = POSE_SIGMA_PX / (STEP_PX * strip.pair.f_px)
    return _gather_cells(chart, places_px, per_depth, sigma, pose_sigma=pose_sigma)


def overlap_strip(first: EyeLook, second: EyeLook, halves: tuple[Picture, Picture]) -> OverlapStrip | None:
    """Return an overlap, rotated so that parallax runs along rows; None where the parallax is too small."""
    corners = [_corners(look, half) for look, half in zip((first, second), halves, strict=True)]
    low = np.maximum(corners[0].min(axis=1), corners[1].min(axis=1))
    middle = (low + np.minimum(corners[0].max(axis=1), corners[1].max(axis=1))) / 2
    way = _parallax_px_m(second, middle) - _parallax_px_m(first, middle)
    length = float(np.linalg.norm(way))
    if length < LEAST_PX_M:
        return None
    along = way / length
    turn = np.array([along, [-along[1], along[0]]])
    turned = [turn @ each for each in corners]
    low = np.maximum(turned[0].min(axis=1), turned[1].min(axis=1))
    high = np.minimum(turned[0].max(axis=1), turned[1].max(axis=1) + np.array([length / NEAREST_M, 0.0]))
    width, height = np.floor((high - low) / STEP_PX).astype(int).tolist()
    if min(width, height) < LEAST_OVERLAP_PX / STEP_PX:
        return None
    grid = np.stack(np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5))
    places_px = np.tensordot(turn.T, low[:, None, None] + STEP_PX * grid, axes=1)
    views = [_sample_view(look, half, places_px) for look, half in zip((first, second), halves, strict=True)]
    pair = RectifiedPair(
        left=views[0][0],
        right=views[1][0],
        valid_left=views[0][1],
        valid_right=views[1][1],
        f_px=length / STEP_PX,
        baseline_m=1.0,
        u0_left_px=0.0,
        u0_right_px=0.0,
        v0_px=0.0,
        pose_sigma_px=0.0,
        t_ns=0,
    )
    return OverlapStrip(pair=pair, places_px=places_px, along=along)


def _triangulate(
    strip: OverlapStrip, found: DisparityMap, first: EyeLook, second: EyeLook
) -> tuple[Floats, Floats, Floats]:
    """Return plane positions (2, n), q and its error (n,), of the matched px, solved exactly."""
    known = np.isfinite(found.residual_px)
    apart = STEP_PX * found.residual_px[known].astype(np.float64)
    here = strip.places_px[:, known]
    moving = _parallax_px_m(first, here)
    other = _parallax_px_m(second, here - strip.along[:, None] * apart)
    per_depth = apart / (strip.along @ (other - moving))
    sigma = found.sigma_px[known].astype(np.float64) / strip.pair.f_px
    good = (per_depth > 1.0 / FARTHEST_M) & (per_depth < 1.0 / NEAREST_M)
    places_px = here + per_depth * moving
    return places_px[:, good], per_depth[good], sigma[good]


def _gather_cells(
    chart: Chart, places_px: Floats, per_depth: Floats, sigma: Floats, *, pose_sigma: float
) -> CellDepth | None:
    """Collect samples in cells: the median of each, as a mean over a jump would be neither side."""
    origin = np.array([[chart.u0_px], [chart.v0_px]])
    column, row = np.floor((places_px + 0.5 - origin) / CELL).astype(int)
    inside = (column >= 0) & (column < chart.columns) & (row >= 0) & (row < chart.rows)
    if not inside.any():
        return None
    row, column, q, error = row[inside], column[inside], per_depth[inside], sigma[inside]
    top, left = int(row.min()), int(column.min())
    shape = int(row.max()) - top + 1, int(column.max()) - left + 1
    flat = (row - top) * shape[1] + column - left
    order = np.lexsort((q, flat))
    cells, start, count = np.unique(flat[order], return_index=True, return_counts=True)
    enough = count >= LEAST_SAMPLES
    chosen = order[(start + count // 2)[enough]]
    values = np.full((3, shape[0] * shape[1]), np.nan, dtype=np.float32)
    values[:2, cells[enough]] = q[chosen], error[chosen]
    kept, errors, edge = values.reshape(3, *shape)
    return CellDepth(row=top, column=left, per_depth=kept, sigma=errors, edge=edge, pose_sigma=pose_sigma)


def _weighted_medians(chart: Chart, patches: Sequence[CellDepth]) -> Cells:
    """Return the weighted median of the overlaps' depth per cell, NaN where there is none."""
    out = np.full((chart.rows, chart.columns), np.nan, dtype=np.float32)
    for rows, columns in blocks(out.shape):
        layers = [
            crop_layers(patch, rows, columns) for patch in patches if overlaps_block(patch, rows, columns)
        ]
        if layers:
            block = np.array(layers)
            with np.errstate(invalid="ignore"):
                weight = np.nan_to_num(1.0 / (block[:, 1] ** 2 + block[:, 2] ** 2))
            order = np.argsort(block[:, 0], axis=0)
            total = np.cumsum(np.take_along_axis(weight, order, axis=0), axis=0)
            middle = np.argmax(total >= 0.5 * total[-1:], axis=0)[None]
            chosen = np.take_along_axis(order, middle, axis=0)
            out[rows, columns] = np.take_along_axis(block[:, 0], chosen, axis=0)[0]
    return out


def _sample_view(look: EyeLook, half: Picture, places_px: Floats) -> tuple[Picture, NDArray[np.bool_]]:
    """Return a view at positions (2, h, w) of objects at infinity, and where it covers them."""
    x, y = look.raw(places_px[0], places_px[1], np.zeros(1))
    maps = [((raw + 0.5) / STEP_PX - 0.5).astype(np.float32) for raw in (x, y)]
    image = cv2.remap(half, maps[0], maps[1], cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    height, width = half.shape
    inside = (x > EDGE_PX) & (x < STEP_PX * width - 1 - EDGE_PX)
    inside &= (y > EDGE_PX) & (y < STEP_PX * height - 1 - EDGE_PX)
    return np.asarray(image, dtype=np.uint8), inside


def _corners(look: EyeLook, half: Picture) -> Floats:
    """Return (2, 4) plane positions of the frame's corners for objects at infinity."""
    height, width = (STEP_PX * size - 1 for size in half.shape)
    raw_px = np.array([[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]])
    return look.plane(raw_px, 0.0).T


def _parallax_px_m(look: EyeLook, places_px: Floats) -> Floats:
    """Return the motion with q of objects at positions (2, ...) at infinity, px m."""
    beside = (2,) + (1,) * (places_px.ndim - 1)
    about = places_px - (look.gaze_px + look.shift_px).reshape(beside)
    return np.asarray(look.pivot_px_m.reshape(beside) + look.pupil_m * about, dtype=np.float64)


def _overlap(first: MosaicView, second: MosaicView) -> bool:
    a, b = first.box, second.box
    across, down = min(a[2], b[2]) - max(a[0], b[0]), min(a[3], b[3]) - max(a[1], b[1])
    return min(across, down) > LEAST_OVERLAP_PX


def _half_size(picture: Picture) -> Picture:
    size = (picture.shape[1] // int(STEP_PX), picture.shape[0] // int(STEP_PX))
    return np.asarray(cv2.resize(gray(picture), size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
