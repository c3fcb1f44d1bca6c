"""Angular resolution of the calibrated cameras straight ahead, in pixels of the unbinned sensor a degree."""

import math

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.geometry.plane_window import homography_apply
from foveacam_pipeline.models.calibration import Calibration, EyeCalibration

_PER_DEG = math.radians(1.0)


def px_per_deg(calibration: Calibration, role: Role) -> float:
    """Return the sensor pixels per degree of a camera; for the wide camera, at its optical centre."""
    if role is Role.WIDE:
        return _PER_DEG * (calibration.wide.fx_px + calibration.wide.fy_px) / 2.0
    eye = calibration.eye(role)
    plane_from_raw = eye.homography.at(*ahead_rad(eye))
    return _PER_DEG * calibration.fovea_f_px / _magnification(plane_from_raw, eye.homography.centre_px)


def ahead_rad(eye: EyeCalibration) -> tuple[float, float]:
    """Return the gaze (ax, ay) straight ahead, rad, or the middle of a field that does not contain it."""
    if eye.mirror.contains(0.0, 0.0):
        return 0.0, 0.0
    low, high = eye.mirror.hull_rad.min(axis=0), eye.mirror.hull_rad.max(axis=0)
    middle = (low + high) / 2.0
    return float(middle[0]), float(middle[1])


def _magnification(plane_from_raw: NDArray[np.float64], at_px: tuple[float, float]) -> float:
    """Return the size of a raw pixel in px of the virtual pinhole (root of the area)."""
    x, y = at_px
    square = homography_apply(plane_from_raw, [[x, y], [x + 1.0, y], [x, y + 1.0]])
    across, down = square[1] - square[0], square[2] - square[0]
    return math.sqrt(abs(float(across[0] * down[1] - across[1] * down[0])))
