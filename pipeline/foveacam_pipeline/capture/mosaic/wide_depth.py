"""Depth from matching one eye's foveae against the wide view, for rendering where stereo has none.

At the size of cells the mosaic is as coarse as the wide view, and both are pinholes with parallel axes,
half the baseline apart: a rectified pair. It covers all that one fovea sees, to a percent or so.
"""

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.capture.mosaic.chart import CELL, Chart
from foveacam_pipeline.capture.mosaic.fuse import FieldDepth, fill_gaps, speckle_mask
from foveacam_pipeline.capture.mosaic.views import Floats, MosaicView, ViewPictureCache
from foveacam_pipeline.capture.mosaic.wide import WideView
from foveacam_pipeline.stereo.match import gray, match
from foveacam_pipeline.stereo.search import MatchSettings
from foveacam_pipeline.stereo.values import RectifiedPair

NEAREST_M, FARTHEST_M = 1.4, 1e4
MOST_SIGMA_PX = 0.6
SETTINGS = MatchSettings(
    near_m=NEAREST_M, far_m=FARTHEST_M, speckle_px=100, max_sigma_px=MOST_SIGMA_PX, uniqueness_percent=12
)
AGREE_SHARE = 0.1
"""Maximum median difference of the wide view's depth from stereo, as a share."""
Cells = NDArray[np.float32]


def add_wide_depth(
    depth: FieldDepth,
    views: Sequence[MosaicView],
    pictures: ViewPictureCache,
    *,
    chart: Chart,
    wide: WideView | None,
) -> FieldDepth:
    """Return the depth with gaps filled from the wide view; unchanged where that contradicts stereo."""
    if wide is None:
        return depth
    pair = wide_pair(views, pictures, chart=chart, wide=wide, filled=depth.filled)
    beside = pair.left.shape[1] - chart.columns
    found = match(pair, SETTINGS).residual_px[:, beside:] / np.float32(pair.f_px * pair.baseline_m)
    per_depth = found[:, ::-1] if wide.eye_x_m > 0.0 else found
    per_depth = np.where(per_depth > 1.0 / FARTHEST_M, per_depth, np.nan).astype(np.float32)
    both = np.isfinite(per_depth) & np.isfinite(depth.per_depth)
    if both.any() and float(np.median(np.abs(per_depth / depth.per_depth - 1.0)[both])) > AGREE_SHARE:
        return depth
    provisional = np.where(np.isfinite(depth.provisional), depth.provisional, per_depth)
    provisional[speckle_mask(provisional)] = np.nan
    return replace(depth, provisional=provisional, filled=fill_gaps(provisional))


def wide_pair(
    views: Sequence[MosaicView], pictures: ViewPictureCache, *, chart: Chart, wide: WideView, filled: Cells
) -> RectifiedPair:
    """Return the foveae, and the wide view at infinity, both at the size of cells.

    Windows reach as far beyond the chart as the nearest objects move. For the right eye both are mirrored,
    so that the wide view is always the right one of the two.
    """
    f_px, baseline_m = chart.f_px / CELL, abs(wide.eye_x_m)
    beyond = int(f_px * baseline_m / NEAREST_M)
    mirrored = wide.eye_x_m > 0.0
    seen, valid = _views_in_cells(views, pictures, chart, filled)
    columns = slice(0, chart.columns + beyond) if mirrored else slice(-beyond, chart.columns)
    u_px, v_px = chart.cell_centres(slice(0, chart.rows), columns)
    x, y = wide.pixels(u_px, v_px, np.zeros((chart.rows, chart.columns + beyond)))
    maps = x.astype(np.float32), y.astype(np.float32)
    other = cv2.remap(gray(wide.picture), *maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    height, width = wide.picture.shape[:2]
    inside = (maps[0] > 0) & (maps[0] < width - 1) & (maps[1] > 0) & (maps[1] < height - 1)
    margin = (0, beyond) if mirrored else (beyond, 0)
    left = np.pad(seen, ((0, 0), margin), mode="edge")
    valid = np.pad(valid, ((0, 0), margin))
    turn = -1 if mirrored else 1
    gain = float(np.median(left[valid])) / max(1.0, float(np.median(other[inside]))) if valid.any() else 1.0
    right = np.clip(np.asarray(other, dtype=np.float32) * gain, 0, 255).astype(np.uint8)
    return RectifiedPair(
        left=np.ascontiguousarray(left[:, ::turn]),
        right=np.ascontiguousarray(right[:, ::turn]),
        valid_left=np.ascontiguousarray(valid[:, ::turn]),
        valid_right=np.ascontiguousarray(inside[:, ::turn]),
        f_px=f_px,
        baseline_m=baseline_m,
        u0_left_px=0.0,
        u0_right_px=0.0,
        v0_px=0.0,
        pose_sigma_px=0.0,
        t_ns=0,
    )


def _views_in_cells(
    views: Sequence[MosaicView], pictures: ViewPictureCache, chart: Chart, filled: Cells
) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
    """Return the foveae at the size of cells, grey, and which cells they see."""
    total, weight = (np.zeros((chart.rows, chart.columns), dtype=np.float32) for _ in range(2))
    for view in views:
        rows, columns = _cells_of(view, chart)
        u_px, v_px = chart.cell_centres(rows, columns)
        x, y = view.look.raw(u_px, v_px, filled[rows, columns].astype(np.float64))
        image, inside = _sample_small(gray(pictures.picture(view)), x, y)
        share = np.maximum(inside, np.float32(0.0))
        total[rows, columns] += share * image
        weight[rows, columns] += share
    mean = total / np.maximum(weight, np.float32(1e-9))
    return np.clip(np.rint(mean), 0, 255).astype(np.uint8), weight > 0.0


def _cells_of(view: MosaicView, chart: Chart) -> tuple[slice, slice]:
    """Return the rows and columns of the cells that a view may cover."""
    left, top, right, bottom = (
        int((edge - origin) // CELL)
        for edge, origin in zip(view.box, 2 * (chart.u0_px, chart.v0_px), strict=True)
    )
    rows = slice(max(0, top), min(chart.rows, bottom + 1))
    return rows, slice(max(0, left), min(chart.columns, right + 1))


def _sample_small(picture: NDArray[np.uint8], x: Floats, y: Floats) -> tuple[Cells, Cells]:
    """Return a picture, scaled to cells, at positions (h, w), and their distance inside it, px."""
    height, width = picture.shape
    size = (width // CELL, height // CELL)
    small = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
    at = [
        ((places + 0.5) * (count / whole) - 0.5).astype(np.float32)
        for places, count, whole in ((x, size[0], width), (y, size[1], height))
    ]
    image = cv2.remap(small, at[0], at[1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    inside = np.minimum(np.minimum(x, width - 1 - x), np.minimum(y, height - 1 - y))
    return np.asarray(image, dtype=np.float32), inside.astype(np.float32)
