"""A camera of the moved rig as the world sees it: projections from the rig's frame to the world's."""

from collections.abc import Callable
from dataclasses import replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.sim.optics import rotation
from foveacam_hardware.sim.render.projection import Projection

Matrix: TypeAlias = NDArray[np.float64]
"""(4, 4) float64, a rigid motion, metres."""

PIVOT_M = (0.0, 0.055, -0.035)  # deduced: a rig's plate on a motorised head


class Pedestal:
    """The axes and the rail, as built: where each stands in the rig when all are at zero."""

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
        """Return the rigid motion (4, 4) from the world, where the rig stands at 0/0, to the moved rig."""
        pan = _about(self._pan_axis, self._pan_m, np.deg2rad(pan_deg))
        tilt = _about(self._tilt_axis, self._tilt_m, np.deg2rad(tilt_deg))
        world_from_rig = pan @ tilt
        world_from_rig[:3, 3] += 1e-3 * slide_mm * self._rail_axis  # the pan-tilt stands on the rail
        back = np.eye(4)
        back[:3, :3] = world_from_rig[:3, :3].T
        back[:3, 3] = -world_from_rig[:3, :3].T @ world_from_rig[:3, 3]
        return back


def _unit(x: float, y: float, z: float) -> NDArray[np.float64]:
    vector = np.array([x, y, z])
    return np.asarray(vector / np.linalg.norm(vector), dtype=np.float64)


def _about(axis: NDArray[np.float64], through_m: NDArray[np.float64], angle_rad: float) -> Matrix:
    """Return the rotation (4, 4) by an angle about an axis through a point."""
    turned = np.eye(4)
    turned[:3, :3] = rotation(axis * angle_rad)
    turned[:3, 3] = through_m - turned[:3, :3] @ through_m
    return turned


Bearing: TypeAlias = Callable[[float], NDArray[np.float64] | None]
"""rig_from_world (4, 4) at a moment of the scene, seconds; None while the rig stands as it was set up."""

GRID = 4
NEAR_M = 1.0
"""What the rig slides past is about as far away, or farther."""


def straight_ahead(t_s: float) -> None:
    """Say that the rig stands as it was set up, whatever the time."""


def in_world(projection: Projection, rig_from_world: NDArray[np.float64] | None) -> Projection:
    """Return a projection of the rig's frame as one of the world's; itself while nothing is turned."""
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


def swept_px(
    projection: Projection, before: NDArray[np.float64] | None, after: NDArray[np.float64] | None
) -> float:
    """Return how far the picture of things at least `NEAR_M` away moves between two stands of the rig, px."""
    if before is None and after is None:
        return 0.0
    before = np.eye(4) if before is None else before
    after = np.eye(4) if after is None else after
    if np.array_equal(before, after):
        return 0.0
    return max(_turned_px(projection, before[:3, :3], after[:3, :3]), _slid_px(projection, before, after))


def _slid_px(projection: Projection, before: NDArray[np.float64], after: NDArray[np.float64]) -> float:
    stood_m, stands_m = (stand[:3, :3].T @ stand[:3, 3] for stand in (before, after))
    focal_px = float(np.sqrt(abs(np.linalg.det(projection.M))))
    return focal_px * float(np.linalg.norm(stands_m - stood_m)) / NEAR_M


def _turned_px(projection: Projection, R0: NDArray[np.float64], R1: NDArray[np.float64]) -> float:
    x, y = np.meshgrid(np.linspace(0, projection.width, GRID), np.linspace(0, projection.height, GRID))
    pixels = np.stack([x.ravel(), y.ravel(), np.ones(x.size)])
    moved = projection.M @ (R1 @ R0.T) @ np.linalg.solve(projection.M, pixels)
    return float(np.max(np.hypot(*(moved[:2] / moved[2] - pixels[:2]))))
