"""Plane maps with obstacles and targets, given or drawn at random (Sec. 4.4.3).

x and y are in metres, right-handed, y up in every figure. What is visible from where is in `regions`.
"""

import math
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon, box

from foveacam_hardware.contract import InvalidInput

TRIES = 2000
"""Positions tried for one target or one obstacle of a random map before an error is raised."""

PlanPoint = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class FieldMap:
    """A map: `bounds_m` is x0, y0, x1, y1; obstacles are polygons, holes allowed; targets are points.

    Obstacles are cut at the bounds, so that there may be more or fewer of them than were given. Targets may
    be none. Raise InvalidInput for bounds of no extent, a polygon that crosses itself, and a target outside
    the bounds or in an obstacle.
    """

    bounds_m: tuple[float, float, float, float]
    obstacles: tuple[Polygon, ...] = ()
    targets_m: tuple[PlanPoint, ...] = ()

    def __post_init__(self) -> None:
        """Check the map, and cut the obstacles at its bounds."""
        x0, y0, x1, y1 = self.bounds_m
        if not all(map(math.isfinite, self.bounds_m)) or not (x0 < x1 and y0 < y1):
            raise InvalidInput(
                f"bounds of {self.bounds_m} m were given; they are x0, y0, x1, y1 with x0 < x1 and y0 < y1"
            )
        for index, obstacle in enumerate(self.obstacles):
            _check_obstacle(obstacle, index)
        object.__setattr__(self, "obstacles", _cut(self.obstacles, self.area))
        for index, target in enumerate(self.targets_m):
            _check_target(target, index, self)

    @property
    def area(self) -> Polygon:
        """The rectangle of the bounds."""
        return box(*self.bounds_m)

    @property
    def size_m(self) -> tuple[float, float]:
        """Width and height."""
        x0, y0, x1, y1 = self.bounds_m
        return x1 - x0, y1 - y0


@dataclass(frozen=True, slots=True, kw_only=True)
class RandomMap:
    """Settings of random maps.

    Targets first: uniform, `edge_m` or more from the bounds, `target_gap_m` or more from each other. Then
    `obstacle_count` obstacles, or a Poisson number of them with `obstacles_per_m2`: centres uniform in the
    bounds, radius uniform in `radii_m`, corners at random on that circle; they may overlap each other, and
    leave `target_clear_m` to every target and the agent's radius besides.
    """

    size_m: tuple[float, float] = (40.0, 40.0)
    target_count: int = 4
    obstacle_count: int = 40
    obstacles_per_m2: float | None = None
    radii_m: tuple[float, float] = (0.4, 1.2)
    corners: tuple[int, int] = (5, 9)
    edge_m: float = 11.0
    target_gap_m: float = 1.5
    target_clear_m: float = 0.5
    agent_radius_m: float = 0.3

    def __post_init__(self) -> None:
        """Refuse settings from which no map can be drawn."""
        for name, low, high in (("radii", *self.radii_m), ("corners", *self.corners)):
            if not 0.0 < low <= high < math.inf:
                raise InvalidInput(
                    f"{name} from {low} to {high} were given; the first is above 0, not above the last"
                )
        if self.corners[0] < 3:
            raise InvalidInput(f"obstacles of {self.corners[0]} corners were asked for; 3 are the least")
        if min(self.target_count, self.obstacle_count) < 0 or (self.obstacles_per_m2 or 0.0) < 0.0:
            raise InvalidInput("fewer than no obstacles or targets were asked for; 0 or more are possible")
        least = min(self.edge_m, self.target_gap_m, self.target_clear_m, self.agent_radius_m)
        if not least >= 0.0 or not min(self.size_m) > 2.0 * self.edge_m:
            raise InvalidInput(
                f"a map of {self.size_m[0]} m by {self.size_m[1]} m with {self.edge_m} m between targets and "
                "its edge was asked for; clearances are 0 m or more, and twice the edge less than either side"
            )


def random_map(settings: RandomMap, *, seed: int | tuple[int, ...]) -> FieldMap:
    """Return a random map, the same for the same seed.

    Raise InvalidInput where targets or obstacles do not fit.
    """
    rng = np.random.default_rng(seed)
    width_m, height_m = settings.size_m
    targets_m = _draw_targets(settings, rng)
    count = settings.obstacle_count
    if settings.obstacles_per_m2 is not None:
        count = int(rng.poisson(settings.obstacles_per_m2 * width_m * height_m))
    obstacles = tuple(_draw_obstacle(settings, targets_m, rng) for _ in range(count))
    return FieldMap(
        bounds_m=(0.0, 0.0, width_m, height_m),
        obstacles=obstacles,
        targets_m=tuple((float(x), float(y)) for x, y in targets_m),
    )


def _draw_targets(settings: RandomMap, rng: np.random.Generator) -> NDArray[np.float64]:
    found = np.empty((0, 2))
    size_m, edge_m = np.array(settings.size_m), settings.edge_m
    for _ in range(settings.target_count):
        tried_m = rng.uniform(edge_m, size_m - edge_m, (TRIES, 2))
        apart_m = np.linalg.norm(tried_m[:, None] - found[None], axis=2)
        fits = np.flatnonzero((apart_m >= settings.target_gap_m).all(axis=1))
        if not len(fits):
            raise InvalidInput(
                f"{settings.target_count} targets {settings.target_gap_m} m apart find no room; ask for "
                "fewer, or for a larger map"
            )
        found = np.vstack([found, tried_m[fits[0]]])
    return found


def _draw_obstacle(settings: RandomMap, targets_m: NDArray[np.float64], rng: np.random.Generator) -> Polygon:
    radius_m = rng.uniform(*settings.radii_m)
    room_m = radius_m + settings.target_clear_m + settings.agent_radius_m
    for _ in range(TRIES):
        centre_m = rng.uniform((0.0, 0.0), settings.size_m)
        if (np.linalg.norm(targets_m - centre_m, axis=1) >= room_m).all():
            break
    else:
        raise InvalidInput(
            f"an obstacle of radius {radius_m:.2f} m finds no room beside the targets; ask for fewer "
            "targets, smaller obstacles, or a larger map"
        )
    corners = int(rng.integers(settings.corners[0], settings.corners[1], endpoint=True))
    # one corner in every equal part of the circle: no needles
    turns = (np.arange(corners) + rng.uniform(0.1, 0.9, corners)) / corners
    angle_rad = 2.0 * math.pi * (turns + rng.uniform())
    return Polygon(centre_m + radius_m * np.column_stack([np.cos(angle_rad), np.sin(angle_rad)]))


def _check_obstacle(obstacle: Polygon, index: int) -> None:
    if obstacle.is_empty or not np.isfinite(shapely.get_coordinates(obstacle)).all():
        raise InvalidInput(f"obstacle {index} has no outline of numbers; leave it out or draw it again")
    if not obstacle.is_valid:
        found = shapely.is_valid_reason(obstacle)
        raise InvalidInput(
            f"obstacle {index} is no simple polygon ({found}); draw its outline without crossing itself"
        )


def _cut(obstacles: tuple[Polygon, ...], area: Polygon) -> tuple[Polygon, ...]:
    inside = shapely.covered_by(np.array(obstacles, dtype=object), area)
    kept: list[Polygon] = []
    for obstacle, whole in zip(obstacles, inside, strict=True):
        parts = [obstacle] if whole else shapely.get_parts(obstacle.intersection(area)).tolist()
        kept.extend(part for part in parts if isinstance(part, Polygon) and part.area > 0.0)
    return tuple(kept)


def _check_target(target_m: PlanPoint, index: int, field: FieldMap) -> None:
    where = f"target {index} at ({target_m[0]:g}, {target_m[1]:g}) m"
    x0, y0, x1, y1 = field.bounds_m
    if not (x0 <= target_m[0] <= x1 and y0 <= target_m[1] <= y1):
        raise InvalidInput(
            f"{where} is outside the map, x {x0:g} to {x1:g} and y {y0:g} to {y1:g} m; move it inside, or "
            "widen the map"
        )
    point = shapely.Point(target_m)
    for number, obstacle in enumerate(field.obstacles):
        if obstacle.intersects(point):
            raise InvalidInput(
                f"{where} is inside obstacle {number} or on its edge; move the target or the obstacle"
            )
