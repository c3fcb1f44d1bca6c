"""Coarse depth of one look over the whole field of a fovea, from each fovea matched against the wide view.

A fovea reduced to the resolution of the wide view forms a rectified pair with it that has half the baseline:
0.1 px of the wide view are 0.0003 1/m. This also works where the foveae do not overlap, and where one eye
does not see the target.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role, Sighting
from foveacam_pipeline.capture.mosaic.look import EyeLook
from foveacam_pipeline.capture.mosaic.pair_depth import near_jumps
from foveacam_pipeline.geometry.binning import common_binning
from foveacam_pipeline.matching.correlation import largest, score_map
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.match import gray, match
from foveacam_pipeline.stereo.rectify import crossing_z_m, to_uint8
from foveacam_pipeline.stereo.search import STEP, MatchSettings
from foveacam_pipeline.stereo.values import RectifiedPair
from foveacam_pipeline.verge.aim import EYES
from foveacam_pipeline.verge.surroundings.depth_samples import DepthSamples

NEAREST_M, FARTHEST_M = 1.4, 1e4
REDUCED = 8
"""A fovea is reduced by this factor before it is sampled at the wide view's scale (9 px a px)."""
MOST_SIGMA_PX = 0.4
SETTINGS = MatchSettings(
    near_m=NEAREST_M, far_m=FARTHEST_M, speckle_px=60, max_sigma_px=MOST_SIGMA_PX, uniqueness_percent=12
)
LEAST_SIGMA_PX = 0.15
"""Least standard error of a match, px of the wide picture: the two cameras blur differently."""
STEP_PX = 2
"""Spacing of the samples, sensor px of the wide view."""
AGREE_SIGMAS = 4.0
KNOT_PX = 8
"""Spacing at which positions in the wide image are computed exactly, px of the window."""
BLOCK_PX = 8
"""Side of the blocks in which the depths of both eyes are compared, wide px."""
SPARE_PER_M = 0.12
"""Difference of 1/Z from the expected one up to which far surfaces get no extra columns: the repeated border
in such columns costs the matcher a tenth of its samples."""
ROW_STRIDE = 1 << 32
"""Numbers a block by its column and row: one key a sample sorts ten times as fast as two."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Window:
    """The grid of directions of a fovea's field, extended sideways for the search.

    `hx_px`, `hy_px`: (h, w) float64, position relative to the gaze on the eye's plane, fovea px. `turn`: 1 or
    -1; the columns of the right eye are mirrored so that near surfaces move in the same direction.
    """

    hx_px: NDArray[np.float64]
    hy_px: NDArray[np.float64]
    step_px: float
    turn: int


def wide_matches(
    sighting: Sighting, calibration: Calibration, *, expected_per_m: Mapping[Role, float] | None = None
) -> DepthSamples:
    """Return the depth of both foveae against the wide view, without samples on which they disagree.

    `expected_per_m`: as `about_per_m` of `eye_matches`, of each eye.
    """
    expected = expected_per_m or {}
    left, right = (eye_matches(sighting, calibration, role, about_per_m=expected.get(role)) for role in EYES)
    return _agreeing(left, right, block_tan=BLOCK_PX / calibration.wide.fx_px)


def eye_matches(
    sighting: Sighting, calibration: Calibration, role: Role, *, about_per_m: float | None = None
) -> DepthSamples:
    """Return the depth of one fovea against the wide view, without pixels next to a jump of depth.

    `about_per_m`: expected 1/Z, by default where the gazes cross. Far from it fewer samples are found: of a
    wall at 8 m of the scene "bench" nine tenths for 0, six tenths for 0.6.

    Everything is in px of the frames: binned ones are matched at half the scale.
    """
    if sighting.missing is role:
        return DepthSamples.none()
    volts = sighting.volts.left if role is Role.LEFT else sighting.volts.right
    frame = sighting.left if role is Role.LEFT else sighting.right
    binning = common_binning(frame, sighting.wide)
    calibration = calibration.binned(binning)
    look = EyeLook.of(calibration, role, volts)
    expected = 1.0 / crossing_z_m(calibration, sighting.volts) if about_per_m is None else about_per_m
    q_ref = float(np.clip(expected, 0.0, 1.0 / NEAREST_M))
    window = _window(calibration, role, look, q_ref)
    fovea, valid_fovea = _fovea_view(gray(to_uint8(frame)), look, window)
    wide, valid_wide = _wide_view(gray(to_uint8(sighting.wide)), look, window, calibration, role, q_ref)
    if not (valid_fovea & valid_wide).any():
        return DepthSamples.none()
    gain = _gain(fovea, wide, valid_fovea)
    f_px = calibration.fovea_f_px / window.step_px
    half_m = 0.5 * calibration.baseline_m
    pair = RectifiedPair(
        left=fovea,
        right=np.clip(np.rint(wide * gain), 0, 255).astype(np.uint8),
        valid_left=valid_fovea,
        valid_right=valid_wide,
        f_px=f_px,
        baseline_m=half_m,
        u0_left_px=f_px * half_m * q_ref,
        u0_right_px=0.0,
        v0_px=0.0,
        pose_sigma_px=0.0,
        t_ns=frame.t_ns,
    )
    found = match(pair, SETTINGS)
    known = np.isfinite(found.residual_px) & ~near_jumps(pair, found)
    step_px = STEP_PX // binning
    rows, columns = np.nonzero(known[::step_px, ::step_px])
    rows, columns = rows * step_px, columns * step_px
    shift = found.residual_px[rows, columns].astype(np.float64)
    hx, hy = window.hx_px[rows, columns], window.hy_px[rows, columns]
    x_m = float(calibration.reference_rig_m(role)[0])
    moving = look.pivot_px_m[0] + look.pupil_m * hx + calibration.fovea_f_px * x_m
    q = q_ref - window.turn * shift * window.step_px * (1.0 + look.pupil_m * q_ref) / moving
    sigma_px = np.hypot(found.sigma_px[rows, columns], LEAST_SIGMA_PX)
    depth_m = float(1.0 / np.clip(np.median(q), 1e-3, 1.0)) if len(q) else 1.0
    pose_rad = calibration.eye(role).angle_sigma_rad(depth_m)[0]
    good = (q > 1.0 / FARTHEST_M) & (q < 1.0 / NEAREST_M)
    return DepthSamples(
        tangents=_directions(look, hx, hy, q, calibration, x_m)[good],
        inverse_z_per_m=q[good],
        sigma_per_m=(np.hypot(sigma_px / f_px, pose_rad) / half_m)[good],
    )


def _window(calibration: Calibration, role: Role, look: EyeLook, q_ref: float) -> _Window:
    """Return the fovea's field, extended by the shifts of the nearest and the farthest surfaces.

    `q_ref`: 1/Z without a shift. Columns beyond that have nothing to be matched with. Its rows follow the
    epipolar lines, which pupil and pivot incline by up to 3 %.
    """
    step = calibration.fovea_f_px / calibration.wide.fx_px
    width, height = (round(size / step) for size in (calibration.fovea_width, calibration.fovea_height))
    shift_px = calibration.wide.fx_px * 0.5 * calibration.baseline_m
    nearer, farther = (
        int(shift_px * (1.0 / NEAREST_M - q_ref)) + 1 + STEP,
        int(shift_px * max(0.0, q_ref - SPARE_PER_M)),
    )
    turn = 1 if role is Role.LEFT else -1
    x = turn * (np.arange(-nearer, width + farther) - (width - 1) / 2) * step
    y = (np.arange(height) - (height - 1) / 2) * step
    hx, hy = np.meshgrid(x, y)
    sideways = look.pivot_px_m[0] + calibration.fovea_f_px * float(calibration.reference_rig_m(role)[0])
    slope = (look.pivot_px_m[1] + look.pupil_m * hy) / sideways
    return _Window(hx_px=hx, hy_px=hy + slope * hx, step_px=step, turn=turn)


def _fovea_view(
    image: NDArray[np.uint8], look: EyeLook, window: _Window
) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
    """Return a raw fovea resampled to the window, (h, w) uint8, and which of its pixels lie in the frame."""
    back = np.linalg.inv(look.gaze_from_raw)
    w = back[2, 0] * window.hx_px + back[2, 1] * window.hy_px + back[2, 2]
    x = (back[0, 0] * window.hx_px + back[0, 1] * window.hy_px + back[0, 2]) / w
    y = (back[1, 0] * window.hx_px + back[1, 1] * window.hy_px + back[1, 2]) / w
    height, width = image.shape
    small = cv2.resize(image, (width // REDUCED, height // REDUCED), interpolation=cv2.INTER_AREA)
    maps = [((raw_px + 0.5) / REDUCED - 0.5).astype(np.float32) for raw_px in (x, y)]
    view = cv2.remap(small, maps[0], maps[1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    valid = (x > REDUCED) & (x < width - 1 - REDUCED) & (y > REDUCED) & (y < height - 1 - REDUCED)
    return np.asarray(view, dtype=np.uint8), np.asarray(valid, dtype=np.bool_)


def _wide_view(
    image: NDArray[np.uint8],
    look: EyeLook,
    window: _Window,
    calibration: Calibration,
    role: Role,
    q_ref: float,
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Return the wide image, (h, w) float32, resampled to the window's directions at 1/Z = `q_ref`."""
    x_m = float(calibration.reference_rig_m(role)[0])
    rows, columns = (_knots(size) for size in window.hx_px.shape)
    hx, hy = (grid[np.ix_(rows, columns)] for grid in (window.hx_px, window.hy_px))
    tangents = _directions(look, hx.ravel(), hy.ravel(), np.full(hx.size, q_ref), calibration, x_m)
    knots = calibration.wide.pixels(np.arctan(tangents)).reshape(*hx.shape, 2).astype(np.float32)
    x, y = (_between(knots[..., k], window.hx_px.shape) for k in (0, 1))
    height, width = image.shape
    view = cv2.remap(image, x, y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    valid = (x > 1) & (x < width - 2) & (y > 1) & (y < height - 2)
    return np.asarray(view, dtype=np.float32), np.asarray(valid, dtype=np.bool_)


def _gain(fovea: NDArray[np.uint8], wide: NDArray[np.float32], valid: NDArray[np.bool_]) -> float:
    """Return the brightness of a fovea over that of the wide view, where both show the same.

    They do so at an unknown shift along the rows: the one at which the fovea's middle fits best. `valid`:
    (h, w), some of the fovea's pixels are.
    """
    rows, columns = np.flatnonzero(valid.any(axis=1)), np.flatnonzero(valid.any(axis=0))
    (top, bottom), (left, right) = ((a[len(a) // 8], a[-1 - len(a) // 8] + 1) for a in (rows, columns))
    middle = fovea[top:bottom, left:right]
    scores = score_map(wide[top:bottom].astype(np.float32), middle.astype(np.float32))
    at, _ = largest(scores)
    beside = wide[top:bottom, at : at + middle.shape[1]]
    return float(np.median(middle)) / max(1.0, float(np.median(beside)))


def _knots(size: int) -> NDArray[np.intp]:
    """Return integer positions `KNOT_PX` apart, the last one at the end."""
    return np.minimum(np.arange(0, size - 1 + KNOT_PX, KNOT_PX), size - 1)


def _between(knots: NDArray[np.float32], shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Return values (h, w) interpolated linearly between knots (error below 0.01 px by distortion)."""
    rows, columns = (_knots(size) for size in shape)
    down = np.interp(np.arange(shape[0]), rows, np.arange(len(rows))).astype(np.float32)
    right = np.interp(np.arange(shape[1]), columns, np.arange(len(columns))).astype(np.float32)
    map_x, map_y = np.meshgrid(right, down)
    return np.asarray(cv2.remap(knots, map_x, map_y, cv2.INTER_LINEAR), dtype=np.float32)


def _directions(
    look: EyeLook,
    hx: NDArray[np.float64],
    hy: NDArray[np.float64],
    q: NDArray[np.float64],
    calibration: Calibration,
    x_m: float,
) -> NDArray[np.float64]:
    """Return (n, 2) rig tangents of positions relative to the gaze, (n,) each, at 1/Z = `q`."""
    about = np.column_stack([hx, hy])
    positions = look.gaze_px + look.pivot_px_m * q[:, None] + (1.0 + look.pupil_m * q[:, None]) * about
    tangents = positions / calibration.fovea_f_px
    tangents[:, 0] += x_m * q
    return np.asarray(tangents, dtype=np.float64)


def contradicted(
    samples: DepthSamples, *, by: DepthSamples, block_tan: float, sigmas: float = AGREE_SIGMAS
) -> NDArray[np.bool_]:
    """Return (n,) bool: the samples outside the depth range of the samples `by` in the same block.

    `block_tan`: side of a block, tangent units. A block without samples of `by` contradicts nothing.
    """
    if len(samples) == 0 or len(by) == 0:
        return np.zeros(len(samples), dtype=np.bool_)
    columns, rows = np.floor(np.concatenate([samples.tangents, by.tangents]) / block_tan).astype(np.int64).T
    _, block = np.unique(columns * ROW_STRIDE + rows, return_inverse=True)
    own, others = block[: len(samples)], block[len(samples) :]
    low, high, error = (
        np.full(block.max() + 1, np.inf),
        np.full(block.max() + 1, -np.inf),
        np.zeros(block.max() + 1),
    )
    np.minimum.at(low, others, by.inverse_z_per_m)
    np.maximum.at(high, others, by.inverse_z_per_m)
    np.maximum.at(error, others, by.sigma_per_m)
    margin = sigmas * np.hypot(samples.sigma_per_m, error[own])
    q, seen = samples.inverse_z_per_m, np.isfinite(low[own])
    beyond = (q < low[own] - margin) | (q > high[own] + margin)
    return np.asarray(seen & beyond, dtype=np.bool_)


def _agreeing(one: DepthSamples, other: DepthSamples, *, block_tan: float) -> DepthSamples:
    """Return both eyes' samples without those that the other eye contradicts."""
    parts = [
        (one, ~contradicted(one, by=other, block_tan=block_tan)),
        (other, ~contradicted(other, by=one, block_tan=block_tan)),
    ]
    return DepthSamples(
        tangents=np.concatenate([each.tangents[kept] for each, kept in parts]),
        inverse_z_per_m=np.concatenate([each.inverse_z_per_m[kept] for each, kept in parts]),
        sigma_per_m=np.concatenate([each.sigma_per_m[kept] for each, kept in parts]),
    )
