"""Left against right at the point itself: correlation for the whole pixel, least squares for the rest.

The least squares weigh pixels by their nearness to the point, so that they answer for the point and not for
its surroundings. Rows are known to match: where the texture cannot tell them, they are taken to.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role, Sighting
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import crossing_z_m, plane_from_raw, to_uint8
from foveacam_pipeline.verge.template import peak

HALF_PX = 64
"""Half side of the surround that is correlated, fovea px: seven wide px."""
REACH_PX = (20, 12)
"""How far from the place that the wide view tells, along and across the epipolar line, fovea px."""
ROW_PENALTY = 0.05
"""What a match at the end of the reach across the epipolar line loses of its correlation."""
WEIGHT_SIGMA_PX = 28.0
"""About three wide px: as well as anybody can click."""
ROW_SIGMA_PX = 4.0
"""How well the calibration knows that rows match; weighs nothing where there is texture."""
ROUNDS = 5
STOP_PX = 0.01
LARGEST_ROUND_PX = 2.0
CORRELATION = 3.0
"""The optics' blur ties neighbouring pixels together (sigma 1.4 px): fewer samples than pixels, squared."""
FLOOR_SIGMA_PX = 0.03
"""Interpolation leaves this much (deduced from rendered pairs)."""


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
class _Eye:
    """A raw image, its way into the virtual plane, and where in that plane the point should be."""

    image: NDArray[np.uint8]
    plane: NDArray[np.float64]
    centre_px: NDArray[np.float64]

    def cut(self, half_px: tuple[int, int], shift_px: NDArray[np.float64]) -> NDArray[np.float32]:
        """Return the window about the centre moved by `shift_px`: (2,), as (2 hy + 1, 2 hx + 1) float32."""
        u, v = (self.centre_px + shift_px).tolist()
        place = np.array([[1.0, 0.0, half_px[0] - u], [0.0, 1.0, half_px[1] - v], [0.0, 0.0, 1.0]])
        size = (2 * half_px[0] + 1, 2 * half_px[1] + 1)
        view = cv2.warpPerspective(
            self.image, place @ self.plane, size, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE
        )
        return np.asarray(view, dtype=np.float32)


def match_fine(
    sighting: Sighting,
    calibration: Calibration,
    *,
    left_tan: NDArray[np.float64],
    right_tan: NDArray[np.float64],
) -> FineMatch:
    """Match the foveae where the wide view says that the point is.

    `left_tan`, `right_tan`: (2,) tangents from each eye's gaze to the point, as registered.
    """
    z_m = crossing_z_m(calibration, sighting.volts)
    left_px, right_px = left_tan * calibration.fovea_f_px, right_tan * calibration.fovea_f_px
    left = _eye(sighting, calibration, Role.LEFT, z_m, left_px)
    right = _eye(sighting, calibration, Role.RIGHT, z_m, right_px)
    told = left_px - right_px
    return _least_squares(left, right, _correlate(left, right), told)


def _eye(
    sighting: Sighting, calibration: Calibration, role: Role, z_m: float, offset_px: NDArray[np.float64]
) -> _Eye:
    image = gray(to_uint8(sighting.left if role is Role.LEFT else sighting.right))
    height, width = image.shape
    plane = plane_from_raw(calibration, role, sighting.volts, depth_m=z_m)
    middle = plane @ np.array([(width - 1) / 2, (height - 1) / 2, 1.0])
    return _Eye(image=image, plane=plane, centre_px=middle[:2] / middle[2] + offset_px)


def _correlate(left: _Eye, right: _Eye) -> NDArray[np.float64]:
    """Return where the left window is found in the right eye, (2,) fovea px from its centre."""
    patch = left.cut((HALF_PX, HALF_PX), np.zeros(2))
    field = right.cut((HALF_PX + REACH_PX[0], HALF_PX + REACH_PX[1]), np.zeros(2))
    scores = np.nan_to_num(cv2.matchTemplate(field, patch, cv2.TM_CCOEFF_NORMED)).astype(np.float32)
    rows = np.linspace(-1.0, 1.0, scores.shape[0], dtype=np.float32)
    x, y, _ = peak(scores - ROW_PENALTY * rows[:, None] ** 2)
    return np.array([x - REACH_PX[0], y - REACH_PX[1]])


def _least_squares(
    left: _Eye, right: _Eye, start_px: NDArray[np.float64], told_px: NDArray[np.float64]
) -> FineMatch:
    """Refine a start (right minus left) by weighted Gauss-Newton steps on normalised brightness."""
    half = (HALF_PX, HALF_PX)
    axis = np.arange(-HALF_PX, HALF_PX + 1, dtype=np.float64)
    bell = np.exp(-0.5 * (axis / WEIGHT_SIGMA_PX) ** 2)
    weights = np.outer(bell, bell)
    reference = _normalised(left.cut(half, np.zeros(2)), weights)
    place, score = start_px.copy(), 0.0
    sigma = np.array([math.inf, math.inf])
    for _ in range(ROUNDS):
        moved = _normalised(right.cut(half, place), weights)
        if reference is None or moved is None:
            break
        score = float(np.sum(weights * reference * moved) / np.sum(weights))
        misfit = reference - moved
        variance = float(np.sum(weights * misfit * misfit) / np.sum(weights)) * CORRELATION**2 / 2.0
        slope_y, slope_x = np.gradient((reference + moved) / 2.0)
        cross = float(np.sum(weights * slope_x * slope_y))
        prior = variance / ROW_SIGMA_PX**2
        normal = np.array(
            [
                [float(np.sum(weights * slope_x * slope_x)), cross],
                [cross, float(np.sum(weights * slope_y * slope_y)) + prior],
            ]
        )
        side = np.array([float(np.sum(weights * slope * misfit)) for slope in (slope_x, slope_y)])
        side[1] += prior * float(told_px[1] - place[1])
        if not np.linalg.det(normal) > 1e-6:
            break
        step = np.linalg.solve(normal, side)
        sigma = np.sqrt(variance * np.diag(np.linalg.inv(normal)) + FLOOR_SIGMA_PX**2)
        if float(np.abs(step).max()) > LARGEST_ROUND_PX:
            break
        place += step
        if float(np.abs(step).max()) < STOP_PX:
            break
    residual = told_px - place
    return FineMatch(
        residual_x_px=float(residual[0]),
        residual_y_px=float(residual[1]),
        score=score,
        sigma_x_px=float(sigma[0]),
        sigma_y_px=float(sigma[1]),
        strayed_px=float(np.abs(place).max()),
    )


def _normalised(image: NDArray[np.float32], weights: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Return the image with weighted mean 0 and variance 1; None when it is all one grey."""
    total = float(np.sum(weights))
    centred = image - np.sum(weights * image) / total
    deviation = math.sqrt(float(np.sum(weights * centred * centred)) / total)
    return centred / deviation if deviation > 1e-3 else None
