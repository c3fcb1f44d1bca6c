"""Left against right at the point itself: correlation for the whole pixel, least squares for the rest."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role, Sighting
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import crossing_z_m, plane_from_raw, to_uint8
from foveacam_pipeline.verge.least_squares import EyeView, Placed, Window, least_squares
from foveacam_pipeline.verge.template import peak

WIDER = Window(half_px=64, weight_sigma_px=28.0)
"""Its weights are three wide px wide: as well as anybody can click."""
NARROWER = Window(half_px=34, weight_sigma_px=14.0)
GOOD_SCORE = 0.8
REACH_PX = (20, 12)
"""How far from the place that the wide view tells, along and across the epipolar line, fovea px."""
ROW_PENALTY = 0.05
"""What a match at the end of the reach across the epipolar line loses of its correlation."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FineMatch:
    """Left minus right place of the point relative to the gazes, fovea px; correlation; errors by noise.

    `strayed_px`: how far the match lies from the places that the wide view told.
    """

    residual_x_px: float
    residual_y_px: float
    score: float
    sigma_x_px: float
    sigma_y_px: float
    strayed_px: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Pair:
    left: EyeView
    right: EyeView
    told_px: NDArray[np.float64]


def match_fine(
    sighting: Sighting,
    calibration: Calibration,
    *,
    left_tan: NDArray[np.float64],
    right_tan: NDArray[np.float64],
) -> FineMatch:
    """Match the foveae where the wide view says that the point is.

    `left_tan`, `right_tan`: (2,) tangents from each eye's gaze to the point, as registered. The wider window
    is tried first; where it does not fit (a near edge, a thin thing) the narrower one.
    """
    z_m = crossing_z_m(calibration, sighting.volts)
    left_px, right_px = left_tan * calibration.fovea_f_px, right_tan * calibration.fovea_f_px
    pair = _Pair(
        left=_eye(sighting, calibration, Role.LEFT, z_m, left_px),
        right=_eye(sighting, calibration, Role.RIGHT, z_m, right_px),
        told_px=left_px - right_px,
    )
    best = _placed(pair, WIDER)
    if best.score < GOOD_SCORE:
        best = max(best, _placed(pair, NARROWER), key=lambda placed: placed.score)
    return FineMatch(
        residual_x_px=float(pair.told_px[0] - best.place_px[0]),
        residual_y_px=float(pair.told_px[1] - best.place_px[1]),
        score=best.score,
        sigma_x_px=best.sigma_px[0],
        sigma_y_px=best.sigma_px[1],
        strayed_px=float(np.abs(best.place_px).max()),
    )


def _eye(
    sighting: Sighting, calibration: Calibration, role: Role, z_m: float, offset_px: NDArray[np.float64]
) -> EyeView:
    image = gray(to_uint8(sighting.left if role is Role.LEFT else sighting.right))
    height, width = image.shape
    plane = plane_from_raw(calibration, role, sighting.volts, depth_m=z_m)
    middle = plane @ np.array([(width - 1) / 2, (height - 1) / 2, 1.0])
    return EyeView(image=image, plane=plane, centre_px=middle[:2] / middle[2] + offset_px)


def _placed(pair: _Pair, window: Window) -> Placed:
    start_px = _correlate(pair, window)
    return least_squares(pair.left, pair.right, start_px, window=window, told=pair.told_px)


def _correlate(pair: _Pair, window: Window) -> NDArray[np.float64]:
    """Return where the left window is found in the right eye, (2,) fovea px from its centre."""
    half = window.half_px
    patch = pair.left.cut((half, half))
    field = pair.right.cut((half + REACH_PX[0], half + REACH_PX[1]))
    scores = np.nan_to_num(cv2.matchTemplate(field, patch, cv2.TM_CCOEFF_NORMED)).astype(np.float32)
    rows = np.linspace(-1.0, 1.0, scores.shape[0], dtype=np.float32)
    x, y, _ = peak(scores - ROW_PENALTY * rows[:, None] ** 2)
    return np.array([x - REACH_PX[0], y - REACH_PX[1]])
