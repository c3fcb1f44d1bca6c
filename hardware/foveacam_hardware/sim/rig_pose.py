"""The pose of the rig on its pan-tilt and rail, and camera projections in the world frame.

The world is fixed and the rig moves. The pan axis is vertical and carries the tilt axis; both pass a few
centimetres below and behind the wide camera. The rail below them runs to the rig's right. Motions of the
axes are in `pan_tilt`.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.sim.optics import rotation
from foveacam_hardware.sim.render.projection import Projection

Matrix: TypeAlias = NDArray[np.float64]
"""(4, 4) float64, a rigid motion, metres."""
PIVOT_M = (0.0, 0.055, -0.035)  # deduced: the rig's plate on a motorised head
RigPoseAtTime: TypeAlias = Callable[[float], NDArray[np.float64] | None]
"""Returns rig_from_world (4, 4) at a scene time, seconds; None while every axis is at zero."""
GRID = 4
NEAREST_SURFACE_M = 1.0
"""Assumed distance of the nearest surface when the rig moves on its rail."""


class Pedestal:
    """The axes and the rail with assembly errors by seed: their positions in the rig frame at zero."""

    def __init__(self, *, seed: int) -> None:
        rng = np.random.default_rng([seed, 0x9A47])
        pan_lean, tilt_lean = np.deg2rad(rng.uniform(-0.2, 0.2, (2, 2)))
        self._pan_axis = _unit(pan_lean[0], 1.0, pan_lean[1])  # turns +z towards +x
        self._tilt_axis = -_unit(1.0, tilt_lean[0], tilt_lean[1])  # turns +z towards +y
        pivots_m = np.array(PIVOT_M) + rng.uniform(-2e-3, 2e-3, (2, 3))
        self._pan_m, self._tilt_m = pivots_m
        rail_lean = np.deg2rad(rng.uniform(-0.3, 0.3, 2))
        self._rail_axis = _unit(1.0, rail_lean[0], rail_lean[1])

    def rig_from_world(self, pan_deg: float, tilt_deg: float, slide_mm: float = 0.0) -> Matrix:
        """Return rig_from_world (4, 4); it is the identity with every axis at zero."""
        pan = _rotation_about(self._pan_axis, self._pan_m, np.deg2rad(pan_deg))
        tilt = _rotation_about(self._tilt_axis, self._tilt_m, np.deg2rad(tilt_deg))
        world_from_rig = pan @ tilt
        world_from_rig[:3, 3] += 1e-3 * slide_mm * self._rail_axis  # the rail carries the pan-tilt
        rig_from_world = np.eye(4)
        rig_from_world[:3, :3] = world_from_rig[:3, :3].T
        rig_from_world[:3, 3] = -world_from_rig[:3, :3].T @ world_from_rig[:3, 3]
        return rig_from_world


def _unit(x: float, y: float, z: float) -> NDArray[np.float64]:
    vector = np.array([x, y, z])
    return np.asarray(vector / np.linalg.norm(vector), dtype=np.float64)


def _rotation_about(axis: NDArray[np.float64], through_m: NDArray[np.float64], angle_rad: float) -> Matrix:
    """Return the rotation (4, 4) by an angle about an axis through a point."""
    rotated = np.eye(4)
    rotated[:3, :3] = rotation(axis * angle_rad)
    rotated[:3, 3] = through_m - rotated[:3, :3] @ through_m
    return rotated


def unmoved_rig(t_s: float) -> None:
    """Return None: every axis is at zero at any time."""


def project_in_world(projection: Projection, rig_from_world: NDArray[np.float64] | None) -> Projection:
    """Return a projection of the rig frame in the world frame; unchanged where `rig_from_world` is None."""
    if rig_from_world is None:
        return projection
    R, t = rig_from_world[:3, :3], rig_from_world[:3, 3]
    axis = R.T @ projection.axis
    return replace(
        projection,
        M=projection.M @ R,
        C=R.T @ (projection.C - t),
        axis=axis / np.linalg.norm(axis),
    )


def image_motion_px(
    projection: Projection, before: NDArray[np.float64] | None, after: NDArray[np.float64] | None
) -> float:
    """Return the image motion, px, of surfaces beyond `NEAREST_SURFACE_M` between two poses of the rig."""
    if before is None and after is None:
        return 0.0
    before = np.eye(4) if before is None else before
    after = np.eye(4) if after is None else after
    if np.array_equal(before, after):
        return 0.0
    return max(
        _rotation_px(projection, before[:3, :3], after[:3, :3]), _translation_px(projection, before, after)
    )


def _translation_px(projection: Projection, before: NDArray[np.float64], after: NDArray[np.float64]) -> float:
    before_m, after_m = (pose[:3, :3].T @ pose[:3, 3] for pose in (before, after))
    focal_px = float(np.sqrt(abs(np.linalg.det(projection.M))))
    return focal_px * float(np.linalg.norm(after_m - before_m)) / NEAREST_SURFACE_M


def _rotation_px(projection: Projection, R0: NDArray[np.float64], R1: NDArray[np.float64]) -> float:
    x, y = np.meshgrid(np.linspace(0, projection.width, GRID), np.linspace(0, projection.height, GRID))
    pixels = np.stack([x.ravel(), y.ravel(), np.ones(x.size)])
    moved = projection.M @ (R1 @ R0.T) @ np.linalg.solve(projection.M, pixels)
    return float(np.max(np.hypot(*(moved[:2] / moved[2] - pixels[:2]))))
