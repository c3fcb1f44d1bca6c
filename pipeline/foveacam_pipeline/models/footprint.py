"""Compute where the field of a fovea lies in the wide image."""

import math

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import MirrorVolts, Role
from foveacam_pipeline.geometry.angles import angles_from_rays
from foveacam_pipeline.geometry.plane_window import homography_apply
from foveacam_pipeline.geometry.verging import points_on_rays
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
    """Return (4, 2) float64 wide px of the corners of a fovea's field (as `fovea_footprints_px`)."""
    footprint: NDArray[np.float64] = fovea_footprints_px(
        calibration, role, np.array([[volts.x_v, volts.y_v]]), distances_m=np.array([distance_m])
    )[0]
    return footprint


def fovea_footprints_px(
    calibration: Calibration, role: Role, volts_v: NDArray[np.float64], *, distances_m: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return (n, 4, 2) float64 wide px of the corners of a fovea's field, clockwise from its top left.

    `volts_v`: (n, 2). Each field is taken on the plane Z = const through the point of the gaze at
    `distances_m`: (n,) from the rig's origin, or at infinity. Corners may lie outside the wide image.
    Raise OutOfRange for a distance nearer than the eye.
    """
    gazes_rad = calibration.eye(role).mirror.angles_of(volts_v)
    directions = np.column_stack([np.tan(gazes_rad), np.ones(len(gazes_rad))])
    near, depths_m = np.isfinite(distances_m), np.full(len(gazes_rad), math.inf)
    depths_m[near] = points_on_rays(calibration.pivot_rig_m(role), directions[near], distances_m[near])[:, 2]
    corners = np.column_stack([fovea_corners_px(calibration), np.ones(4)])
    mapped = calibration.rectifications(role, gazes_rad, depths_m=depths_m) @ corners.T  # (n, 3, corners)
    offsets = (mapped[:, :2] / mapped[:, 2:]).transpose(0, 2, 1) / calibration.fovea_f_px
    rays = np.concatenate([directions[:, None, :2] + offsets, np.ones((len(offsets), 4, 1))], axis=2)
    rays[near] = calibration.reference_rig_m(role) + depths_m[near, None, None] * rays[near]
    return calibration.wide.pixels(angles_from_rays(rays.reshape(-1, 3))).reshape(-1, 4, 2)
