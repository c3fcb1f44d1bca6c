"""A camera of the moved rig as the world sees it: projections from the rig's frame to the world's."""

from collections.abc import Callable
from dataclasses import replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.sim.render.projection import Projection

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
