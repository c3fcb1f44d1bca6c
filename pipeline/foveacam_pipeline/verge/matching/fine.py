"""Match of left against right at the point itself: correlation to the whole pixel, then least squares.

Sizes and results are in sensor px; binned pictures are compared in windows of the same angle.
"""

import math
from dataclasses import dataclass
from itertools import product

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Binning, Role, Sighting
from foveacam_pipeline.geometry.binning import common_binning
from foveacam_pipeline.matching.correlation import peak, score_map
from foveacam_pipeline.matching.picture import InterpolatedPicture, WindowPlacement, doubled
from foveacam_pipeline.matching.windows import MatchWindow
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import plane_from_raw, to_uint8
from foveacam_pipeline.verge.aim import gazes_under
from foveacam_pipeline.verge.matching.contrast import even
from foveacam_pipeline.verge.matching.match_in_rows import SubpixelPosition, match_in_rows

WIDER = MatchWindow(half_px=64, weight_sigma_px=28.0)
"""Its weights are three wide px wide, the accuracy of a click. Sensor px, as all sizes here."""
NARROWER = MatchWindow(half_px=34, weight_sigma_px=14.0)
BETWEEN = MatchWindow(half_px=48, weight_sigma_px=20.0)
"""For grain along the rows, where the narrower window holds too little texture across it."""
LEANS = (0.0, -0.4, -0.8, -1.2, 0.4)
"""Slopes of disparity from row to row, px a px, tried in this order where the wider window does not fit. With
growing disparity the place in the right eye moves left. On a level surface the slope is the baseline over the
height above it: 1 on a table 0.2 m below the eyes."""
GOOD_SCORE = 0.8
GOOD_SIGMA_PX = 0.4
"""A match whose standard error by noise is larger may have the wrong slope."""
SURE_SCORE = 0.9
"""Least correlation at which a narrower or sloped window replaces a first match that is inaccurate."""
REACH_PX = (20, 12)
"""Search range about the place found in the wide view, along and across the epipolar line, fovea px."""
FAR_REACH_PX = (72, 12)
"""The same where the wide view locates the point badly: grain along the rows, a near edge."""
MARGIN_PX = 20
SUPPORTED_PX = WIDER.half_px + MARGIN_PX
"""Half side of the part of each picture that a match compares."""
SPARE_PX = 8
"""Margin read beyond a window for blur and interpolation, px of the frame."""
QUIET_SIGMA_PX = 1.5
"""Blur against noise, as strong as the optics': cuts the noise to a fifth, the texture hardly. Remaining
differences between the eyes are structure: two surfaces in the window, or the wrong place."""
LEAST_CONTRAST = 1.0
"""Contrast below this is noise, grey levels."""
SHADING_PX = 12.0
CONTRAST_PX = 8.0
ROW_PENALTY = 0.05
"""Penalty on the correlation of a match at the end of the search range across the epipolar line."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FineMatch:
    """Left minus right place of the point relative to the gazes, fovea px; correlation; noise errors."""

    residual_x_px: float
    residual_y_px: float
    score: float
    sigma_x_px: float
    sigma_y_px: float
    contrast: float
    """Contrast of the weaker eye's window: 0 to 1, bare noise below 0.3."""
    slope: tuple[float, float]
    """Gradient of the place in the right eye along x and y of the left, px a px: the slope of the surface."""

    @property
    def residual_px(self) -> NDArray[np.float64]:
        """The residual along x and y, (2,) fovea px."""
        return np.array([self.residual_x_px, self.residual_y_px])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MatchGuess:
    """Place of the point in each eye by the wide view, (2,) tangents from the gaze; search range, px."""

    left: NDArray[np.float64]
    right: NDArray[np.float64]
    reach_px: tuple[int, int] = REACH_PX


def match_fine(sighting: Sighting, calibration: Calibration, guess: MatchGuess) -> FineMatch:
    """Match the foveae about a guess.

    The wider window is tried first; where it does not fit (a near edge, a thin thing, a surface seen at a
    grazing angle) or is inaccurate, narrower ones follow, with and without slope.
    """
    z_m = guessed_depth_m(calibration, sighting, guess)
    binning = common_binning(sighting.left, sighting.right)
    left_px, right_px = guess.left * calibration.fovea_f_px, guess.right * calibration.fovea_f_px
    expected_px = left_px - right_px
    half = (WIDER.half_px + MARGIN_PX) // binning
    left = eye_patch(sighting, calibration, Role.LEFT, z_m, left_px, (half, half))
    reach_px = guess.reach_px[0] // binning, guess.reach_px[1] // binning
    right = eye_patch(
        sighting, calibration, Role.RIGHT, z_m, right_px, (half + reach_px[0], half + reach_px[1])
    )
    pair = _Pair(
        left=left, right=right, reach_px=reach_px, expected_px=expected_px / binning, binning=binning
    )
    best = _best_placed(pair)
    residual = expected_px - binning * best.position_px
    return FineMatch(
        residual_x_px=float(residual[0]),
        residual_y_px=float(residual[1]),
        score=best.score,
        sigma_x_px=binning * best.sigma_px[0],
        sigma_y_px=binning * best.sigma_px[1],
        contrast=min(_contrast(left, binning), _contrast(right, binning)),
        slope=(float(best.slope[0]), float(best.slope[1])),
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Pair:
    """Both eyes' pictures, the search range, and the place at which the rows match; picture px."""

    left: InterpolatedPicture
    right: InterpolatedPicture
    reach_px: tuple[int, int]
    expected_px: NDArray[np.float64]
    binning: Binning


def _best_placed(pair: _Pair) -> SubpixelPosition:
    """Return the first match that fits and is accurate; else the first that fits; else the best of all."""
    best, good_sigma_px = _placed(pair, WIDER), GOOD_SIGMA_PX / pair.binning
    for across in LEANS:
        if best.score >= GOOD_SCORE:
            break
        leaning = _placed(pair, NARROWER, across=across)
        best = max(best, leaning, key=lambda placed: placed.score)
    if best.score < GOOD_SCORE or best.sigma_px[0] <= good_sigma_px:
        return best
    for window, across in product((NARROWER, BETWEEN), LEANS):
        leaning = _placed(pair, window, across=across)
        if leaning.score >= SURE_SCORE and leaning.sigma_px[0] < best.sigma_px[0]:
            best = leaning
        if best.sigma_px[0] <= good_sigma_px:
            break
    return best


def _contrast(picture: InterpolatedPicture, binning: Binning) -> float:
    """Return the standard deviation of an equalised patch close to the point."""
    half = NARROWER.half_px // binning
    return float(picture.cut((half, half)).std())


def guessed_depth_m(calibration: Calibration, sighting: Sighting, guess: MatchGuess) -> float:
    """Return the depth along z of a guess, m, at which the parallax of pivots and pupils is corrected."""
    gazes = gazes_under(calibration, sighting.volts)
    apart = float(gazes.left[0] + guess.left[0] - gazes.right[0] - guess.right[0])
    return calibration.baseline_m / apart if apart > 0.0 else math.inf


def eye_patch(
    sighting: Sighting,
    calibration: Calibration,
    role: Role,
    z_m: float,
    offset_px: NDArray[np.float64],
    half_px: tuple[int, int],
) -> InterpolatedPicture:
    """Return one eye's view around the point on its virtual plane, equalised, at the frame's resolution.

    `offset_px`: (2,) of the point from the gaze, sensor px. `half_px`: half sides, px of the frame.
    """
    frame = sighting.left if role is Role.LEFT else sighting.right
    height, width = frame.image.shape[:2]
    own = calibration.binned(frame.binning)
    plane = plane_from_raw(own, role, sighting.volts, depth_m=z_m)
    middle = plane @ np.array([(width - 1) / 2, (height - 1) / 2, 1.0])
    u, v = (middle[:2] / middle[2] + offset_px / frame.binning).tolist()
    corner = np.array([[1.0, 0.0, half_px[0] - u], [0.0, 1.0, half_px[1] - v], [0.0, 0.0, 1.0]])
    size = (2 * half_px[0] + 1, 2 * half_px[1] + 1)
    view = _read_plane(to_uint8(frame), corner @ plane, size, quiet_sigma_px=QUIET_SIGMA_PX / frame.binning)
    return InterpolatedPicture.of(
        even(
            view,
            shading_px=SHADING_PX / frame.binning,
            contrast_px=CONTRAST_PX / frame.binning,
            least=LEAST_CONTRAST,
        )
    )


def _read_plane(
    image: NDArray[np.uint8],
    window_from_raw: NDArray[np.float64],
    size: tuple[int, int],
    *,
    quiet_sigma_px: float,
) -> NDArray[np.float32]:
    """Return the window of (width, height), slightly blurred; only the part it shows is processed."""
    rim = np.array([[0.0, 0.0], [size[0], 0.0], [size[0], size[1]], [0.0, size[1]]])
    seen = np.column_stack([rim, np.ones(4)]) @ np.linalg.inv(window_from_raw).T
    seen = seen[:, :2] / seen[:, 2:]
    most = np.array(image.shape[1::-1])
    low = np.clip(np.floor(seen.min(axis=0)) - SPARE_PX, 0, most - 2 * SPARE_PX).astype(int)
    high = np.clip(np.ceil(seen.max(axis=0)) + SPARE_PX, low + 2 * SPARE_PX, most).astype(int)
    part = gray(np.ascontiguousarray(image[low[1] : high[1], low[0] : high[0]])).astype(np.float32)
    quiet = np.asarray(cv2.GaussianBlur(part, (0, 0), quiet_sigma_px), dtype=np.float32)
    raw_from_double = np.array([[0.5, 0.0, low[0]], [0.0, 0.5, low[1]], [0.0, 0.0, 1.0]])
    view = cv2.warpPerspective(
        doubled(quiet),
        window_from_raw @ raw_from_double,
        size,
        flags=cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )
    return np.asarray(view, dtype=np.float32)


def _placed(pair: _Pair, of_sensor: MatchWindow, *, across: float = 0.0) -> SubpixelPosition:
    """Find the left window in the right eye, sheared by `across`; the place is right minus left, frame px."""
    window, reach_px = of_sensor.binned(pair.binning), pair.reach_px
    half = window.half_px
    patch = pair.left.cut((half, half))
    field = pair.right.cut((half + reach_px[0], half + reach_px[1]), WindowPlacement(xy=across))
    scores = score_map(field, patch)
    rows = np.linspace(-1.0, 1.0, scores.shape[0], dtype=np.float32)
    scores -= ROW_PENALTY * rows[:, None] ** 2
    x, y, _ = peak(scores)
    down_px = y - reach_px[1]
    start = WindowPlacement(x_px=x - reach_px[0] + across * down_px, y_px=down_px, xy=across)
    return match_in_rows(
        pair.left, pair.right, start, window=window, expected_px=pair.expected_px, binning=pair.binning
    )
