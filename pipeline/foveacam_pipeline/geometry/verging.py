"""Compute the gaze of each eye so that both meet on one target.

A target is a direction from the rig's origin (the wide camera's centre) and a distance from there.
"""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foveacam_hardware.contract import OutOfRange
from foveacam_pipeline.geometry.angles import ray


def point_from_direction(ax_rad: float, ay_rad: float, distance_m: float) -> NDArray[np.float64]:
    """Return the (3,) float64 point, m, rig frame, at `distance_m` from the rig's origin."""
    if not (distance_m > 0.0 and math.isfinite(distance_m)):
        raise OutOfRange(
            f"target distance: {distance_m} m was asked; give a finite distance above 0 m "
            "(infinity is steered parallel)"
        )
    point: NDArray[np.float64] = distance_m * ray(ax_rad, ay_rad)
    return point


def eye_angles(point_rig_m: ArrayLike, pivot_rig_m: ArrayLike) -> tuple[float, float]:
    """Return (ax, ay), rad, of a point as seen from an eye's pivot; both (3,) m, rig frame."""
    x, y, z = (float(c) for c in np.asarray(point_rig_m, dtype=np.float64) - np.asarray(pivot_rig_m))
    if not z > 0.0:
        raise OutOfRange(
            f"target at z = {z:.3f} m from the eye: it lies behind the mirror; aim in front of it"
        )
    return math.atan(x / z), math.atan(y / z)


def vergence_angles(
    ax_rad: float, ay_rad: float, distance_m: float, *, pivots_rig_m: tuple[ArrayLike, ArrayLike]
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the (ax, ay), rad, of the left and of the right eye that meet on the target.

    `distance_m` may be infinity: then both look parallel to (ax, ay). `pivots_rig_m`: left, right, (3,) m.
    """
    if distance_m == math.inf:
        return (ax_rad, ay_rad), (ax_rad, ay_rad)
    point = point_from_direction(ax_rad, ay_rad, distance_m)
    return eye_angles(point, pivots_rig_m[0]), eye_angles(point, pivots_rig_m[1])


def point_on_ray(origin_rig_m: ArrayLike, direction: ArrayLike, distance_m: float) -> NDArray[np.float64]:
    """Return the (3,) point, m, of one ray (as `points_on_rays`)."""
    way = np.asarray(direction, dtype=np.float64)[None]
    point: NDArray[np.float64] = points_on_rays(origin_rig_m, way, np.array([distance_m]))[0]
    return point


def points_on_rays(
    origin_rig_m: ArrayLike, directions: NDArray[np.float64], distances_m: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the (n, 3) points, m, where rays from `origin_rig_m` leave spheres of radius `distances_m`.

    The spheres are centred on the rig's origin. `directions`: (n, 3) of any length; `distances_m`: (n,)
    m, finite. Raise OutOfRange for a distance nearer than the rays' origin.
    """
    origin = np.asarray(origin_rig_m, dtype=np.float64)
    ways = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    nearest_m = float(np.linalg.norm(origin))
    if not (distances_m > nearest_m).all():
        raise OutOfRange(
            f"distance {distances_m[~(distances_m > nearest_m)][0]} m from the rig's origin is nearer than "
            f"the eye itself ({nearest_m:.3f} m); give a larger one"
        )
    along = ways @ origin
    reach = -along + np.sqrt(along * along - float(origin @ origin) + distances_m * distances_m)
    points: NDArray[np.float64] = origin + reach[:, None] * ways
    return points
