"""Where each eye must look so that both meet on one target.

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
    """Return the (3,) point, m, where a ray from `origin_rig_m` leaves the sphere of radius `distance_m`.

    The sphere is centred on the rig's origin. `direction`: (3,) of any length.
    """
    origin = np.asarray(origin_rig_m, dtype=np.float64)
    way = np.asarray(direction, dtype=np.float64)
    way = way / np.linalg.norm(way)
    if not distance_m > float(np.linalg.norm(origin)):
        raise OutOfRange(
            f"distance {distance_m} m from the rig's origin is nearer than the eye itself "
            f"({float(np.linalg.norm(origin)):.3f} m); give a larger one"
        )
    along = float(origin @ way)
    reach = -along + math.sqrt(along * along - float(origin @ origin) + distance_m * distance_m)
    point: NDArray[np.float64] = origin + reach * way
    return point
