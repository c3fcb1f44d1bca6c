"""Exact feasible regions as polygons: annulus, line of sight, room for the agent (Sec. 4.4, Fig. 7).

`raster_regions` computes the same by cells, as a check that shares no code with this.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry
from shapely.geometry.polygon import orient

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.study.visibility.maps import FieldMap, PlanPoint
from foveacam_pipeline.study.visibility.standoff import StandoffRing

CHORDS = 128
"""Chords of a circle; as a polygon of the same area, its edge is off by 2.1e-4 of the radius at most."""

CORNER_CHORDS = 8
"""Chords of a quarter circle about an obstacle's corner: all of them lack 0.65 % of the agent's disc."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RegionAreas:
    """Areas from which targets are observed unnoticed, m².

    `multi_m2`: of the union of the targets' regions. `single_m2`: of one target's region, mean over the
    targets. `weighted_m2`: sum of the targets' regions, that is, area weighted by the targets in sight.
    """

    multi_m2: float
    single_m2: float
    weighted_m2: float


def disc(centre_m: PlanPoint, radius_m: float) -> Polygon:
    """Return a circle as a polygon of `CHORDS` chords with the circle's area (error 0, to rounding)."""
    step_rad = 2.0 * math.pi / CHORDS
    reach_m = radius_m * math.sqrt(step_rad / math.sin(step_rad))
    angle_rad = step_rad * np.arange(CHORDS)
    return Polygon(np.array(centre_m) + reach_m * np.column_stack([np.cos(angle_rad), np.sin(angle_rad)]))


def annulus(centre_m: PlanPoint, ring: StandoffRing) -> BaseGeometry:
    """Return a ring about a target as a polygon; empty where the ring is (Eqs. 7, 8)."""
    if ring.empty:
        return Polygon()
    outer = disc(centre_m, ring.outer_m)
    return outer.difference(disc(centre_m, ring.inner_m)) if ring.inner_m > 0.0 else outer


def free_space(field: FieldMap, *, agent_radius_m: float) -> BaseGeometry:
    """Return where the agent's centre may be: its disc is within the bounds and meets no obstacle.

    Obstacles grow by the agent's radius, their corners by arcs of `CORNER_CHORDS` chords a quarter.
    """
    if not 0.0 <= agent_radius_m < math.inf:
        raise InvalidInput(f"an agent of radius {agent_radius_m} m was given; 0 m or more is possible")
    x0, y0, x1, y1 = field.bounds_m
    if min(field.size_m) <= 2.0 * agent_radius_m:
        return Polygon()
    room = shapely.box(x0 + agent_radius_m, y0 + agent_radius_m, x1 - agent_radius_m, y1 - agent_radius_m)
    return room.difference(grown_obstacles(field, agent_radius_m))


def grown_obstacles(field: FieldMap, by_m: float) -> BaseGeometry:
    """Return the union of the obstacles, each grown by `by_m`."""
    obstacles = np.array(field.obstacles, dtype=object)
    if not len(obstacles):
        return Polygon()
    grown = shapely.buffer(obstacles, by_m, quad_segs=CORNER_CHORDS) if by_m > 0.0 else obstacles
    union: BaseGeometry = shapely.union_all(grown)
    return union


def shadows(field: FieldMap, target_m: PlanPoint, *, outer_m: float) -> BaseGeometry:
    """Return the shadows of the obstacles as seen from a target, exact as far as `outer_m`, undefined beyond.

    The shadow of a convex outline is convex: the hull of the outline and of its tangents' far ends. An
    obstacle that is not convex or has holes has the shadows of its edges.
    """
    obstacles = np.array(field.obstacles, dtype=object)
    close = obstacles[shapely.distance(obstacles, shapely.Point(target_m)) < outer_m]
    outlines = [outline for obstacle in close for outline in _convex_outlines(obstacle, target_m)]
    if not outlines:
        return Polygon()
    owner = np.repeat(np.arange(len(outlines)), [len(outline) for outline in outlines])
    far_m = 1.5 * max(outer_m, max(float(np.hypot(*outline.T).max()) for outline in outlines))
    ends = np.concatenate([_far_ends(outline, far_m) for outline in outlines])
    points = np.concatenate([*outlines, ends]) + target_m
    owner = np.concatenate([owner, np.repeat(np.arange(len(outlines)), 3)])
    order = np.argsort(owner, kind="stable")
    # lines, since only their points matter for a hull, and a line is built from one array
    clouds = shapely.linestrings(points[order], indices=owner[order])
    union: BaseGeometry = shapely.union_all(shapely.convex_hull(clouds))
    return union


def feasible_region(
    field: FieldMap, target: int, ring: StandoffRing, *, agent_radius_m: float
) -> BaseGeometry:
    """Return the feasible region of a target: annulus, line of sight, no collision (Sec. 4.4).

    `target`: its index. The line runs from the agent's centre to the target; obstacles block it with their
    own outlines, and exclude the agent with outlines grown by its radius. The other targets' stealth bounds
    are not part of it. Circles are polygons of equal area (`disc`), tangents exact. Raise InvalidInput for an
    unknown target, and for a ring or an agent of impossible size.
    """
    if not 0 <= target < len(field.targets_m):
        raise InvalidInput(
            f"target {target} was asked for; the map has {len(field.targets_m)}, counted from 0"
        )
    free = free_space(field, agent_radius_m=agent_radius_m)
    return _region(field, field.targets_m[target], ring, free)


def feasible_regions(
    field: FieldMap, ring: StandoffRing, *, agent_radius_m: float
) -> tuple[BaseGeometry, ...]:
    """Return `feasible_region` of every target, in their order."""
    free = free_space(field, agent_radius_m=agent_radius_m)
    return tuple(_region(field, target_m, ring, free) for target_m in field.targets_m)


def regions_within(
    field: FieldMap, regions: Sequence[BaseGeometry], *, outer_m: float
) -> tuple[BaseGeometry, ...]:
    """Return the regions for a smaller outer bound, cut from those of a larger one."""
    return tuple(
        region.intersection(disc(target_m, outer_m))
        for target_m, region in zip(field.targets_m, regions, strict=True)
    )


def region_areas(regions: Sequence[BaseGeometry], *, union: BaseGeometry | None = None) -> RegionAreas:
    """Return the three areas of the targets' regions; `union` is given where it is known.

    Raise InvalidInput where there is no target.
    """
    if not regions:
        raise InvalidInput("the map has no target, so that there is nothing to observe; place at least one")
    each_m2 = [float(region.area) for region in regions]
    together = shapely.union_all(list(regions)) if union is None else union
    return RegionAreas(
        multi_m2=float(together.area), single_m2=sum(each_m2) / len(each_m2), weighted_m2=sum(each_m2)
    )


def _region(field: FieldMap, target_m: PlanPoint, ring: StandoffRing, free: BaseGeometry) -> BaseGeometry:
    if not 0.0 <= ring.inner_m < math.inf or not 0.0 <= ring.outer_m < math.inf:
        raise InvalidInput(
            f"a ring from {ring.inner_m} m to {ring.outer_m} m was given; both are numbers of 0 m or more"
        )
    if ring.empty:
        return Polygon()
    around = annulus(target_m, ring).intersection(free)
    return around.difference(shadows(field, target_m, outer_m=ring.outer_m))


def _convex_outlines(obstacle: Polygon, target_m: PlanPoint) -> Iterator[NDArray[np.float64]]:
    """Yield (n, 2) corners relative to the target, of convex outlines that cast the obstacle's shadow.

    They are the obstacle's own outline, or those of its edges that face the target, whose shadows cover the
    others'.
    """
    outline = shapely.get_coordinates(obstacle.exterior)[:-1] - target_m
    hull_m2 = obstacle.convex_hull.area
    if not obstacle.interiors and math.isclose(obstacle.area, hull_m2, rel_tol=1e-12):
        yield outline
        return
    turned = orient(obstacle)  # the obstacle lies to the left of every edge
    for ring in (turned.exterior, *turned.interiors):
        corners = shapely.get_coordinates(ring) - target_m
        (ax, ay), (bx, by) = corners[:-1].T, corners[1:].T
        yield from np.stack([corners[:-1], corners[1:]], axis=1)[ax * by - ay * bx < 0.0]


def _far_ends(outline: NDArray[np.float64], far_m: float) -> NDArray[np.float64]:
    """Return (3, 2) points at `far_m` from the origin behind an outline: of both tangents and between them.

    An outline that does not hold the origin fills less than pi; each half of it less than pi/2, so that the
    chords between the points stay beyond far_m / sqrt(2).
    """
    middle = outline.mean(axis=0)
    angle_rad = np.arctan2(
        middle[0] * outline[:, 1] - middle[1] * outline[:, 0], outline @ middle
    )  # from the direction to the middle, which lies between the tangents
    first, last = outline[angle_rad.argmin()], outline[angle_rad.argmax()]
    bisector_rad = math.atan2(middle[1], middle[0]) + (angle_rad.min() + angle_rad.max()) / 2.0
    between = np.array([math.cos(bisector_rad), math.sin(bisector_rad)])
    return far_m * np.array([first / np.hypot(*first), between, last / np.hypot(*last)])
