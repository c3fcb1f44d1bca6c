"""Where a fovea's field lies in the wide image."""

import math

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import MirrorVolts, Role
from foveacam_pipeline.geometry.angles import angles_from_rays, ray
from foveacam_pipeline.geometry.pinhole import homography_apply
from foveacam_pipeline.geometry.verging import point_on_ray
from foveacam_pipeline.models.calibration import Calibration


def fovea_corners_px(calibration: Calibration) -> NDArray[np.float64]:
    """Return (4, 2) raw px: the outer corners of a fovea image, clockwise from the top left."""
    right, bottom = calibration.fovea_width - 0.5, calibration.fovea_height - 0.5
    return np.array([[-0.5, -0.5], [right, -0.5], [right, bottom], [-0.5, bottom]])


def fovea_points_rays(
    calibration: Calibration, role: Role, volts: MirrorVolts, *, raw_px: NDArray[np.float64], depth_m: float
) -> NDArray[np.float64]:
    """Return (n, 3) float64 (X/Z, Y/Z, 1) from the eye's reference point of raw px (n, 2) at depth Z."""
    ax_rad, ay_rad = calibration.eye(role).mirror.angles_rad(volts)
    offset = homography_apply(calibration.rectification(role, ax_rad, ay_rad, depth_m=depth_m), raw_px)
    tangents = np.array([math.tan(ax_rad), math.tan(ay_rad)]) + offset / calibration.fovea_f_px
    return np.column_stack([tangents, np.ones(len(tangents))])


def fovea_footprint_px(
    calibration: Calibration, role: Role, volts: MirrorVolts, distance_m: float = math.inf
) -> NDArray[np.float64]:
    """Return (4, 2) float64 wide px of the corners of a fovea's field, clockwise from its top left.

    The field is taken on the plane Z = const through the point of the gaze at `distance_m` from the rig's
    origin, or at infinity. Corners may lie outside the wide image.
    """
    depth_m = math.inf
    if math.isfinite(distance_m):
        gaze = calibration.eye(role).mirror.angles_rad(volts)
        depth_m = float(point_on_ray(calibration.pivot_rig_m(role), ray(*gaze), distance_m)[2])
    corners = fovea_corners_px(calibration)
    rays = fovea_points_rays(calibration, role, volts, raw_px=corners, depth_m=depth_m)
    if math.isfinite(depth_m):
        rays = calibration.reference_rig_m(role) + depth_m * rays
    return calibration.wide.pixels(angles_from_rays(rays))
