"""The plan of the toy scene of Fig. 8: one target among obstacles, and the corners of the floor's tiles.

The simulated rig renders it as the scene `toy`; this plan holds the same positions and sizes. Plan axes: x to
the right, y forward, metres (the scene's x and z).
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from shapely import Point, Polygon, affinity

from foveacam_pipeline.study.visibility.maps import FieldMap
from foveacam_pipeline.study.visibility.regions import free_space

SCENE = "toy"
"""The name of the simulated scene."""
TILE_M = 1.25
TILES = 12
"""Along each side of the hall."""
TARGET_M = (0.55, 7.9)
STAND_HALF_M = 0.1
"""Distance of the labels from the middle of the target's stand; they hang on its eight sides."""
AGENT_RADIUS_M = 0.25
"""The rig on its base: half of 0.5 m."""
D_MIN_M = 2.5
"""Chosen by us: about a third of D_max."""
COLUMN_SIDES = 24
BOXES: tuple[tuple[tuple[float, float], tuple[float, float], float], ...] = (
    ((-2.6, 5.4), (1.3, 0.5), 20.0),
    ((3.4, 6.1), (0.6, 1.2), -15.0),
    ((2.2, 10.9), (1.4, 0.5), 30.0),
    ((-3.1, 10.0), (0.7, 0.7), 45.0),
    ((-5.3, 7.6), (0.5, 1.5), 0.0),
)
"""Middle, sides along x and y before it is turned, and turn in degrees, clockwise as seen from above."""
COLUMNS: tuple[tuple[tuple[float, float], float], ...] = (
    ((0.2, 4.6), 0.35),
    ((-0.9, 11.6), 0.4),
    ((5.2, 9.1), 0.45),
)
"""Middle and radius."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AgentPose:
    """Position and heading of an agent: `heading_rad` is clockwise from +y as seen from above."""

    x_m: float
    y_m: float
    heading_rad: float = 0.0


def toy_map() -> FieldMap:
    """Return the plan of the scene: outlines of the obstacles, and the middle of the target's stand."""
    half_m = TILES * TILE_M / 2.0
    boxes = tuple(_box(centre_m, size_m, turn_deg) for centre_m, size_m, turn_deg in BOXES)
    columns = tuple(_column(centre_m, radius_m) for centre_m, radius_m in COLUMNS)
    return FieldMap(
        bounds_m=(-half_m, 0.0, half_m, 2.0 * half_m), obstacles=boxes + columns, targets_m=(TARGET_M,)
    )


def corners_m(*, every: int = 1) -> NDArray[np.float64]:
    """Return the tile corners off the walls, (n, 2) metres; `every`: stride along each axis."""
    inner = np.arange(1, TILES)[(every - 1) // 2 :: every] * TILE_M
    x_m, y_m = np.meshgrid(inner - TILES * TILE_M / 2.0, inner)
    return np.column_stack([x_m.ravel(), y_m.ravel()])


def has_room(points_m: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return for each of (n, 2) points, metres, whether the rig's base fits there between the obstacles."""
    free = free_space(toy_map(), agent_radius_m=AGENT_RADIUS_M)
    return np.array([bool(free.covers(Point(at))) for at in points_m], dtype=np.bool_)


def _box(centre_m: tuple[float, float], size_m: tuple[float, float], turn_deg: float) -> Polygon:
    half_x, half_y = size_m[0] / 2.0, size_m[1] / 2.0
    outline = Polygon([(-half_x, -half_y), (half_x, -half_y), (half_x, half_y), (-half_x, half_y)])
    turned = affinity.rotate(outline, -turn_deg, origin=(0.0, 0.0))
    moved: Polygon = affinity.translate(turned, *centre_m)
    return moved


def _column(centre_m: tuple[float, float], radius_m: float) -> Polygon:
    angles_rad = np.arange(COLUMN_SIDES) * (2.0 * math.pi / COLUMN_SIDES)
    return Polygon(np.array(centre_m) + radius_m * np.column_stack([np.cos(angles_rad), np.sin(angles_rad)]))
