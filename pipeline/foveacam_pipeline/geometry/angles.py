"""Axis-wise angles, their tangents, and unit rays.

An angle pair (ax, ay) names the direction (tan ax, tan ay, 1): +ax looks right, +ay looks down, in the
axes of the rig frame (x right, y down, z forward). All angles are radians.
"""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foveacam_hardware.contract import OutOfRange
from foveacam_pipeline.geometry.shapes import as_rows


def tan_from_angles(angles_rad: ArrayLike) -> NDArray[np.float64]:
    """Return (n, 2) float64 (X/Z, Y/Z) of `angles_rad`: (n, 2)."""
    return np.tan(as_rows(angles_rad, columns=2, name="angles_rad"))


def angles_from_tan(tangents: ArrayLike) -> NDArray[np.float64]:
    """Return (n, 2) float64 angles, rad, of `tangents`: (n, 2) (X/Z, Y/Z)."""
    return np.arctan(as_rows(tangents, columns=2, name="tangents"))


def rays_from_angles(angles_rad: ArrayLike) -> NDArray[np.float64]:
    """Return (n, 3) float64 unit rays of `angles_rad`: (n, 2)."""
    tangents = tan_from_angles(angles_rad)
    rays = np.column_stack([tangents, np.ones(len(tangents))])
    unit: NDArray[np.float64] = rays / np.linalg.norm(rays, axis=1, keepdims=True)
    return unit


def angles_from_rays(rays: ArrayLike) -> NDArray[np.float64]:
    """Return (n, 2) float64 angles, rad, of `rays`: (n, 3), any length, all looking forward."""
    rows = as_rows(rays, columns=3, name="rays")
    behind = ~(rows[:, 2] > 0.0)
    if behind.any():
        index = int(np.argmax(behind))
        raise OutOfRange(
            f"ray {index} is {rows[index].tolist()}: it does not look forward (z > 0); "
            "axis-wise angles exist only in front of the rig"
        )
    return np.arctan(rows[:, :2] / rows[:, 2:])


def ray(ax_rad: float, ay_rad: float) -> NDArray[np.float64]:
    """Return the (3,) float64 unit ray of one direction."""
    direction = np.array([math.tan(ax_rad), math.tan(ay_rad), 1.0])
    unit: NDArray[np.float64] = direction / np.linalg.norm(direction)
    return unit
