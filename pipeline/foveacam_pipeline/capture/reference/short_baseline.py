"""Depth by the short baseline: the values to be judged, and the start of the long-baseline search."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from foveacam_hardware.contract import Role
from foveacam_pipeline.capture.mosaic.pair_depth import (
    MOST_SIGMA_PX,
    DepthPixels,
    match_pair,
    triangulate_pair,
)
from foveacam_pipeline.capture.mosaic.pairs import combined_look, matching_partners
from foveacam_pipeline.capture.mosaic.values import MosaicSettings
from foveacam_pipeline.capture.mosaic.views import MosaicView
from foveacam_pipeline.capture.reference.values import Floats, ReferenceSettings
from foveacam_pipeline.capture.reference.views import FoveaView
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.match import match
from foveacam_pipeline.stereo.rectify import halved, rectify
from foveacam_pipeline.stereo.search import MAX_DISPARITIES, MatchSettings
from foveacam_pipeline.stereo.values import DisparityMap, RectifiedPair

SCALE = 0.5
"""Scale at which pairs are matched, as for the depth of a look."""
MARGIN_PX = 6.0
ABOUT_PX = 45.0
"""Half side of the neighbourhood to which a plane is fitted, full-size px."""
LEAST_ABOUT = 150
FLAT_SHARE = 0.97
FLAT_SIGMAS = 3.5
"""Share of the neighbourhood that must lie within `FLAT_SIGMAS` of a plane, which excludes depth steps."""
EDGE_PX = 90.0
"""Samples nearer than this to the frame's edge are not used."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ShortBaselineSample:
    """A point of a left fovea with short-baseline depth.

    `anchor`: the view's number; `right_point`: the point whose right fovea it was matched with. `u_px`,
    `v_px`: on the eye's plane for `q0`. `q`: 1 / Z as measured there, `sigma` by matching, `pose_sigma` by
    the calibration, 1/m. `q0`, `slope`: (2,) the local plane of 1 / Z, 1/m and 1/m per px.
    """

    anchor: int
    right_point: int
    raw_px: tuple[float, float]
    u_px: float
    v_px: float
    q: float
    sigma: float
    pose_sigma: float
    q0: float
    slope: Floats


def samples_of(
    anchor: FoveaView, views: Sequence[MosaicView], calibration: Calibration, settings: ReferenceSettings
) -> list[ShortBaselineSample]:
    """Return samples on a grid over a left fovea, away from depth jumps.

    `views`: all points of the judged scan. Verged on the scene's average, a point's own right fovea shows
    less than its left one; right foveae of other points show what lies nearer or farther.
    """
    view = next(each for each in views if each.point.index == anchor.point.index)
    found: dict[int, ShortBaselineSample] = {}
    mosaic = MosaicSettings(scan=view.point.place.scan, bracket=settings.bracket)
    for other in matching_partners(view, views, calibration):
        sighting = combined_look(view, other, mosaic)
        known = _match_pair(rectify(sighting, calibration, scale=SCALE))
        if known is None:
            continue
        dense = triangulate_pair(*known, calibration, sighting.volts, eye=Role.LEFT)
        for cell, index in _on_grid(anchor, dense, across=settings.across, calibration=calibration):
            sample = _sample(anchor, other.point.index, calibration, dense, index)
            if sample is not None and (cell not in found or sample.sigma < found[cell].sigma):
                found[cell] = sample
    return [found[cell] for cell in sorted(found)]


def _match_pair(pair: RectifiedPair) -> tuple[RectifiedPair, DisparityMap] | None:
    """Return the disparities of a half-size pair, or of a smaller one for a large depth range."""
    found = match_pair(halved(pair))
    if found is None:
        return None
    small, disparity = found
    known = disparity.residual_px[np.isfinite(disparity.residual_px)]
    if len(known) < LEAST_ABOUT:
        return None
    scale = pair.f_px / small.f_px
    low, high = (scale * float(px) for px in np.percentile(known, (0.5, 99.5)))
    low, high = low - MARGIN_PX, high + MARGIN_PX
    if high - low > MAX_DISPARITIES or low + pair.offset_px <= 0.0:
        return found
    f_b = pair.f_px * pair.baseline_m
    near_m, far_m = f_b / (high + pair.offset_px), f_b / (low + pair.offset_px)
    return pair, match(pair, MatchSettings(near_m=near_m, far_m=far_m, max_sigma_px=MOST_SIGMA_PX))


def _on_grid(
    anchor: FoveaView, dense: DepthPixels, *, across: int, calibration: Calibration
) -> Iterator[tuple[int, int]]:
    """Yield each cell's number of a grid over the frame, and the reliable sample nearest its middle."""
    x, y = anchor.look.raw(dense.u_px, dense.v_px, dense.per_depth)
    pitch = (calibration.fovea_width - 2.0 * EDGE_PX) / across
    down = max(1, round((calibration.fovea_height - 2.0 * EDGE_PX) / pitch))
    column, row = np.floor((x - EDGE_PX) / pitch), np.floor((y - EDGE_PX) / pitch)
    within = ~dense.edge & (column >= 0) & (column < across) & (row >= 0) & (row < down)
    off_x = x - EDGE_PX - (column + 0.5) * pitch
    off_y = y - EDGE_PX - (row + 0.5) * pitch
    distance = np.where(within, np.hypot(off_x, off_y), np.inf)
    order = np.argsort(distance, kind="stable")[: int(within.sum())]
    cell = (row[order] * across + column[order]).astype(int)
    cells, first = np.unique(cell, return_index=True)
    return ((int(number), int(order[at])) for number, at in zip(cells, first, strict=True))


def _sample(
    anchor: FoveaView, right_point: int, calibration: Calibration, dense: DepthPixels, index: int
) -> ShortBaselineSample | None:
    """Return a sample with its local plane; None where the neighbourhood is not planar."""
    du, dv = dense.u_px - dense.u_px[index], dense.v_px - dense.v_px[index]
    about = (np.abs(du) < ABOUT_PX) & (np.abs(dv) < ABOUT_PX)
    if int(about.sum()) < LEAST_ABOUT:
        return None
    design = np.column_stack([np.ones(int(about.sum())), du[about], dv[about]])
    q, sigma = dense.per_depth[about], dense.sigma[about]
    weight = 1.0 / sigma
    for _ in range(3):
        plane, *_ = np.linalg.lstsq(design * weight[:, None], q * weight, rcond=None)
        off = np.abs(design @ plane - q) / sigma
        weight = np.minimum(1.0, 2.0 / np.maximum(off, 1e-9)) / sigma
    per_depth = float(dense.per_depth[index])
    own = abs(per_depth - float(plane[0])) / float(dense.sigma[index])
    if float(np.mean(off < FLAT_SIGMAS)) < FLAT_SHARE or own > FLAT_SIGMAS or not plane[0] > 0.0:
        return None
    u, v = np.asarray(dense.u_px[index]), np.asarray(dense.v_px[index])
    x, y = anchor.look.raw(u, v, np.asarray(per_depth))
    at = anchor.look.plane(np.array([[float(x), float(y)]]), float(plane[0]))[0]
    f_b = calibration.fovea_f_px * calibration.baseline_m
    return ShortBaselineSample(
        anchor=anchor.number,
        right_point=right_point,
        raw_px=(float(x), float(y)),
        u_px=float(at[0]),
        v_px=float(at[1]),
        q=per_depth,
        sigma=float(dense.sigma[index]),
        pose_sigma=calibration.pose_sigma_px(1.0 / per_depth) / f_b,
        q0=float(plane[0]),
        slope=np.asarray(plane[1:], dtype=np.float64),
    )
