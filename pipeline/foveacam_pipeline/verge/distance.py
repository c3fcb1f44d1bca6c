"""Triangulation of a point of the rig frame, with its error, from two lines of sight or from a depth."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.geometry.triangulate import closest_approach, depth_sigma_m, range_sigma_m
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.aim import Gazes

LEAST_SHARE = 0.25
"""Least 1/Z at the far side of its error, as a share of 1/Z: keeps the far distance finite."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LocatedPoint:
    """A point of the rig frame, m; its distance from the rig's origin, and that distance's standard error.

    `distance_sigma_random_m`: the part of the error that differs from look to look; the rest is shared by all
    looks at the point, as the calibration's error is. None where it is not known.
    """

    point_rig_m: tuple[float, float, float]
    distance_m: float
    distance_sigma_m: float
    distance_sigma_random_m: float | None = None


def triangulate(calibration: Calibration, target: Gazes, *, sigma_px: float) -> LocatedPoint | None:
    """Return the point where both eyes' lines of sight meet; None if they diverge.

    `target`: lines of sight from the pivots. `sigma_px`: error of the match between the eyes, fovea px; the
    calibration's error (mirrors and pivots) is added to it.
    """
    meeting = closest_approach(
        calibration.pivot_rig_m(Role.LEFT),
        np.append(target.left, 1.0),
        calibration.pivot_rig_m(Role.RIGHT),
        np.append(target.right, 1.0),
    )
    if not meeting.in_front:
        return None
    point: NDArray[np.float64] = meeting.point_m
    x_m, y_m, z_m = point.tolist()
    both_px = np.array([math.hypot(sigma_px, calibration.pose_sigma_px(z_m)), sigma_px])
    z_sigma_m = depth_sigma_m(z_m, both_px, f_px=calibration.fovea_f_px, baseline_m=calibration.baseline_m)
    sigma_m, random_m = range_sigma_m(
        np.stack([point, point]), z_sigma_m, baseline_m=calibration.baseline_m
    ).tolist()
    return LocatedPoint(
        point_rig_m=(x_m, y_m, z_m),
        distance_m=float(np.linalg.norm(point)),
        distance_sigma_m=sigma_m,
        distance_sigma_random_m=random_m,
    )


def place_on_ray(target: NDArray[np.float64], inverse_z_per_m: float, sigma_per_m: float) -> LocatedPoint:
    """Return the point along (2,) tangents at 1/Z = `inverse_z_per_m` > 0, whose error is `sigma_per_m`.

    An error of 1/Z makes different errors of the distance on either side; the larger, far one is stated.
    """
    way = np.append(target, 1.0)
    x_m, y_m, z_m = (way / inverse_z_per_m).tolist()
    length = float(np.linalg.norm(way))
    farthest = max(inverse_z_per_m - sigma_per_m, LEAST_SHARE * inverse_z_per_m)
    return LocatedPoint(
        point_rig_m=(x_m, y_m, z_m),
        distance_m=length / inverse_z_per_m,
        distance_sigma_m=length * sigma_per_m / (inverse_z_per_m * farthest),
    )
