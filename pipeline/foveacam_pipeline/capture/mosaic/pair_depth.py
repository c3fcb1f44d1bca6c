"""Depth of one pair as cells of a chart: matched at a quarter of the size, triangulated exactly.

A pair is verged on one depth and shows many: a search at a sixteenth of the size finds the range, to which
the matcher is then restricted. Pixels beside a depth jump are kept apart, as they may belong to either
side. The left fovea of one point and the right one of another form a pair as well.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role, Sighting, StereoVolts
from foveacam_pipeline.capture.mosaic.chart import CELL, Chart
from foveacam_pipeline.capture.mosaic.look import EyeLook
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.depth import depth_map, edge_mask
from foveacam_pipeline.stereo.estimator import DepthEstimator
from foveacam_pipeline.stereo.match import match
from foveacam_pipeline.stereo.rectify import crossing_z_m, halved, rectify
from foveacam_pipeline.stereo.search import MAX_DISPARITIES, MatchSettings
from foveacam_pipeline.stereo.values import DisparityMap, RectifiedPair

Floats = NDArray[np.float64]
NEAREST_M = 0.5
BEYOND_M = 1e5
LEAST_KNOWN = 40
"""Minimum number of matched px, at a sixteenth of the size, from which the depth range is estimated."""
MARGIN_PX = 2.0
MOST_SIGMA_PX = 0.45
"""Disparity error above which a px counts as unmatched: noise also matches, but poorly (deduced)."""
COARSE = MatchSettings(near_m=NEAREST_M, far_m=BEYOND_M, block=5, speckle_px=12, uniqueness_percent=5)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CellDepth:
    """A patch of a chart's cells: first row and column, q = 1 / Z, 1/m, (h, w), NaN unknown, and its errors.

    `sigma`: matching error of q; `pose_sigma`: the calibration's, common to the patch. `edge`: q of the
    nearest object where a cell lies beside a depth jump, NaN elsewhere.
    """

    row: int
    column: int
    per_depth: NDArray[np.float32]
    sigma: NDArray[np.float32]
    edge: NDArray[np.float32]
    pose_sigma: float

    @property
    def rows(self) -> slice:
        """Its rows on the chart."""
        return slice(self.row, self.row + self.per_depth.shape[0])

    @property
    def columns(self) -> slice:
        """Its columns on the chart."""
        return slice(self.column, self.column + self.per_depth.shape[1])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DepthPixels:
    """Triangulated px, (n,): plane positions u, v of an eye, full-size px; q = 1 / Z and its error, 1/m.

    `edge`: whether a px lies beside a depth jump.
    """

    u_px: Floats
    v_px: Floats
    per_depth: Floats
    sigma: Floats
    edge: NDArray[np.bool_]


def pair_cells(
    sighting: Sighting,
    calibration: Calibration,
    chart: Chart,
    *,
    eye: Role,
    estimator: DepthEstimator | None = None,
) -> CellDepth:
    """Return the depth of a pair on the chart of an eye; no cells where nothing matches.

    `estimator`: computes the disparities at a quarter of the size; None: `match_pair`.
    """
    pair = halved(rectify(sighting, calibration, scale=0.5))
    found = match_pair(pair) if estimator is None else (pair, estimator.estimate(pair))
    if found is None:
        return _no_cells()
    samples = triangulate_pair(*found, calibration, sighting.volts, eye=eye)
    q = samples.per_depth
    z_m = float(1.0 / np.median(q)) if len(q) else BEYOND_M
    f_b = calibration.fovea_f_px * calibration.baseline_m
    pose_sigma = calibration.pose_sigma_px(max(z_m, NEAREST_M)) / f_b
    return gather_cells(chart, samples, pose_sigma=pose_sigma)


def match_pair(pair: RectifiedPair) -> tuple[RectifiedPair, DisparityMap] | None:
    """Return the disparities of a quarter-size pair, or an eighth-size one for a large depth range.

    None where too little matches to find the depth range.
    """
    eighth = halved(pair)
    coarse = match(halved(eighth), COARSE).residual_px
    known = coarse[np.isfinite(coarse)]
    if len(known) < LEAST_KNOWN:
        return None
    low, high = (4.0 * float(q) for q in np.percentile(known, (1, 99)))
    low, high = low - 4.0 * MARGIN_PX, high + 4.0 * MARGIN_PX
    if high - low > MAX_DISPARITIES:
        return eighth, match(eighth, _range_settings(eighth, low / 2, high / 2))
    return pair, match(pair, _range_settings(pair, low, high))


def _range_settings(pair: RectifiedPair, low_px: float, high_px: float) -> MatchSettings:
    f_b = pair.f_px * pair.baseline_m
    far_m = f_b / max(low_px + pair.offset_px, f_b / BEYOND_M)
    near_m = f_b / max(high_px + pair.offset_px, 2.0 * f_b / BEYOND_M)
    return MatchSettings(near_m=near_m, far_m=far_m, speckle_px=60, max_sigma_px=MOST_SIGMA_PX)


def near_jumps(pair: RectifiedPair, disparity: DisparityMap) -> NDArray[np.bool_]:
    """Return (h, w) bool: px near a jump or end of disparity, where the matcher widens near objects."""
    jumps = edge_mask(pair, depth_map(pair, replace(disparity, residual_px=disparity.residual_px.copy())))
    known = np.isfinite(disparity.residual_px).astype(np.uint8)
    closed = cv2.morphologyEx(known, cv2.MORPH_CLOSE, np.ones((5, 5), dtype=np.uint8))
    firm = cv2.erode(closed, np.ones((9, 9), dtype=np.uint8))
    return np.asarray(jumps | (firm == 0), dtype=np.bool_)


def triangulate_pair(
    pair: RectifiedPair, disparity: DisparityMap, calibration: Calibration, volts: StereoVolts, *, eye: Role
) -> DepthPixels:
    """Return the known depth of a pair.

    The pair's windows are exact for the depth where the gazes cross; here each pixel gets its own depth.
    """
    scale = pair.f_px / calibration.fovea_f_px
    unsure = near_jumps(pair, disparity)
    y, x = np.nonzero(np.isfinite(disparity.residual_px))
    u_left = np.asarray((x + pair.u0_left_px) / scale, dtype=np.float64)
    residual = disparity.residual_px[y, x].astype(np.float64)
    u_right = np.asarray((x - residual + pair.u0_right_px) / scale, dtype=np.float64)
    v = np.asarray((y + pair.v0_px) / scale, dtype=np.float64)
    at = np.array(1.0 / crossing_z_m(calibration, volts))
    left = EyeLook.of(calibration, Role.LEFT, volts.left)
    right = EyeLook.of(calibration, Role.RIGHT, volts.right)
    hx_left, hy_left = left.gaze_relative(u_left, v, at)
    hx_right, hy_right = right.gaze_relative(u_right, v, at)
    f_b = calibration.fovea_f_px * calibration.baseline_m
    apart = left.gaze_px[0] + hx_left - right.gaze_px[0] - hx_right
    moving_left = left.pivot_px_m[0] + left.pupil_m * hx_left
    moving_right = right.pivot_px_m[0] + right.pupil_m * hx_right
    per_depth = apart / (f_b - moving_left + moving_right)
    own = (left, hx_left, hy_left) if eye is Role.LEFT else (right, hx_right, hy_right)
    sigma = disparity.sigma_px[y, x] / scale / f_b
    good = (per_depth > 1.0 / BEYOND_M) & (per_depth < 1.0 / NEAREST_M)
    u, v = (_plane_coordinate(*own, axis=axis, per_depth=per_depth) for axis in (0, 1))
    return DepthPixels(
        u_px=u[good],
        v_px=v[good],
        per_depth=per_depth[good],
        sigma=np.asarray(sigma[good], dtype=np.float64),
        edge=unsure[y, x][good],
    )


def _plane_coordinate(look: EyeLook, hx: Floats, hy: Floats, *, axis: int, per_depth: Floats) -> Floats:
    about = hx if axis == 0 else hy
    fixed = look.gaze_px[axis] + look.pivot_px_m[axis] * per_depth
    return np.asarray(fixed + (1.0 + look.pupil_m * per_depth) * about, dtype=np.float64)


def gather_cells(chart: Chart, samples: DepthPixels, *, pose_sigma: float) -> CellDepth:
    """Collect samples in the cells of a chart as weighted means; the noise of neighbours is correlated."""
    column = np.floor((samples.u_px + 0.5 - chart.u0_px) / CELL).astype(int)
    row = np.floor((samples.v_px + 0.5 - chart.v0_px) / CELL).astype(int)
    inside = (column >= 0) & (column < chart.columns) & (row >= 0) & (row < chart.rows)
    if not inside.any():
        return _no_cells()
    row, column = row[inside], column[inside]
    top, left = int(row.min()), int(column.min())
    shape = int(row.max()) - top + 1, int(column.max()) - left + 1
    flat = (row - top) * shape[1] + column - left
    size = shape[0] * shape[1]
    edge, q = samples.edge[inside], samples.per_depth[inside]
    weight = np.where(edge, 0.0, samples.sigma[inside] ** -2.0)
    total = np.bincount(flat, weight, size)
    count = np.bincount(flat, ~edge, size)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.bincount(flat, weight * q, size) / total
        error = np.sqrt(count / total)
    nearest = np.zeros(size)
    np.maximum.at(nearest, flat[edge], q[edge])
    nearest[(nearest == 0.0) | (count > 0)] = np.nan
    return CellDepth(
        row=top,
        column=left,
        per_depth=mean.reshape(shape).astype(np.float32),
        sigma=error.reshape(shape).astype(np.float32),
        edge=nearest.reshape(shape).astype(np.float32),
        pose_sigma=pose_sigma,
    )


def _no_cells() -> CellDepth:
    empty = np.empty((0, 0), dtype=np.float32)
    return CellDepth(row=0, column=0, per_depth=empty, sigma=empty, edge=empty, pose_sigma=0.0)
