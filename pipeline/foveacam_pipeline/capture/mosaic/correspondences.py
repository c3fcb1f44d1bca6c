"""Corresponding points of overlapping views: their offset on the chart and their ratio of brightness.

They lie on a grid over every overlap; every other one is held out of the adjustment, to validate it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.capture.mosaic.chart import CELL, Chart
from foveacam_pipeline.capture.mosaic.fuse import FieldDepth
from foveacam_pipeline.capture.mosaic.register import REACH_PX, register
from foveacam_pipeline.capture.mosaic.views import (
    ChartPatch,
    Floats,
    MosaicView,
    ViewPictureCache,
    chart_patch,
    warp_view,
)
from foveacam_pipeline.stereo.match import gray

HALF_CELLS = 6
"""Half side of a patch: 96 px, of which the outer 16 are search range."""
MOST_POINTS = 12
"""Points of one overlap: half of them are held out."""
STEP_CELLS = 7
KNOWN_SHARE = 0.9


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ViewCorrespondence:
    """A point that views `first` and `second` (by number) both show.

    `offset_px`: (2,) its chart position by the second minus by the first; `covariance`: (2, 2), px².
    `relative_px`: (2, 2) rows h of the point in the first and in the second view, px (`EyeLook`).
    `brightness`: log of the second view's over the first's. `held_out`: not used by the adjustment.
    """

    first: int
    second: int
    place_px: tuple[float, float]
    offset_px: Floats
    covariance: Floats
    relative_px: Floats
    brightness: float
    held_out: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class OverlapPoint:
    """A point at which two views are compared: the middle cell of a patch."""

    first: int
    second: int
    row: int
    column: int
    held_out: bool


def overlap_points(views: Sequence[MosaicView], chart: Chart) -> list[OverlapPoint]:
    """Return where the overlaps of a scan are compared, at most `MOST_POINTS` points per overlap."""
    return [
        place
        for first in range(len(views))
        for second in range(first + 1, len(views))
        for place in _points_of_overlap(views, chart, first, second)
    ]


def match_overlap(
    place: OverlapPoint,
    views: Sequence[MosaicView],
    pictures: ViewPictureCache,
    *,
    chart: Chart,
    depth: FieldDepth,
) -> ViewCorrespondence | None:
    """Return the correspondence of two views at a point; None where they do not match."""
    rows, columns = patch_cells(place)
    pair = [views[place.first], views[place.second]]
    images = warp_pair(pair, pictures, chart_patch(chart, depth.filled, rows, columns))
    found = None if images is None else register(*images)
    if found is None or images is None:
        return None
    u = chart.u0_px + CELL * place.column - 0.5
    v = chart.v0_px + CELL * place.row - 0.5
    q = np.asarray(depth.filled[place.row, place.column], dtype=np.float64)
    relative = [view.look.gaze_relative(np.asarray(u), np.asarray(v), q) for view in pair]
    return ViewCorrespondence(
        first=place.first,
        second=place.second,
        place_px=(u, v),
        offset_px=found.shift_px,
        covariance=found.covariance,
        relative_px=np.array(relative, dtype=np.float64),
        brightness=float(np.log(max(1.0, float(images[1].mean())) / max(1.0, float(images[0].mean())))),
        held_out=place.held_out or not _known(depth, rows, columns),
    )


def patch_cells(place: OverlapPoint) -> tuple[slice, slice]:
    """Return the rows and columns of the cells that are compared."""
    return (
        slice(place.row - HALF_CELLS, place.row + HALF_CELLS),
        slice(place.column - HALF_CELLS, place.column + HALF_CELLS),
    )


def warp_pair(
    pair: Sequence[MosaicView], pictures: ViewPictureCache, patch: ChartPatch
) -> tuple[NDArray[np.float32], NDArray[np.float32]] | None:
    """Return a patch as two views show it, grey; None where a view does not cover it."""
    warped = [warp_view(view, pictures.picture(view), patch) for view in pair]
    if any(each is None or float(each.inside_px.min()) <= 0.0 for each in warped):
        return None
    first, second = (_grey(each.image) for each in warped if each is not None)
    return first, second


def _known(depth: FieldDepth, rows: slice, columns: slice) -> bool:
    """Return whether the patch's depth is measured; without it an offset may be parallax."""
    return float(np.isfinite(depth.per_depth[rows, columns]).mean()) > KNOWN_SHARE


def _points_of_overlap(
    views: Sequence[MosaicView], chart: Chart, first: int, second: int
) -> Iterator[OverlapPoint]:
    """Yield points that both views certainly cover, spread over the overlap."""
    a, b = views[first].box, views[second].box
    left, top, right, bottom = max(a[0], b[0]), max(a[1], b[1]), min(a[2], b[2]), min(a[3], b[3])
    inset = HALF_CELLS * CELL
    columns = _grid_axis(left + inset - chart.u0_px, right - inset - chart.u0_px, chart.columns)
    rows = _grid_axis(top + inset - chart.v0_px, bottom - inset - chart.v0_px, chart.rows)
    grid = [
        (row, column)
        for row in rows
        for column in columns
        if all(_reaches(views[k], chart, row, column) for k in (first, second))
    ]
    stride = max(1, -(-len(grid) // MOST_POINTS))
    for count, (row, column) in enumerate(grid[stride // 2 :: stride]):
        yield OverlapPoint(first=first, second=second, row=row, column=column, held_out=count % 2 == 1)


def _grid_axis(low_px: float, high_px: float, cells: int) -> range:
    low = max(HALF_CELLS, int(np.ceil(low_px / CELL)))
    high = min(cells - HALF_CELLS, int(np.floor(high_px / CELL)))
    return range(low, high + 1, STEP_CELLS)


def _reaches(view: MosaicView, chart: Chart, row: int, column: int) -> bool:
    """Return whether a view contains a whole patch, with room for the depth to differ."""
    half = HALF_CELLS * CELL
    u = chart.u0_px + CELL * column + np.array([-half, half, half, -half], dtype=np.float64)
    v = chart.v0_px + CELL * row + np.array([-half, -half, half, half], dtype=np.float64)
    x, y = view.look.raw(u, v, np.asarray(view.per_depth))
    frame = next(frame for frame in view.point.frames if frame.role.value != "wide")
    inside = np.minimum(np.minimum(x, frame.width - 1 - x), np.minimum(y, frame.height - 1 - y))
    return bool(inside.min() > REACH_PX)


def _grey(image: NDArray[np.float32]) -> NDArray[np.float32]:
    if image.ndim == 2:
        return image
    return gray(np.clip(np.rint(image), 0, 255).astype(np.uint8)).astype(np.float32)
