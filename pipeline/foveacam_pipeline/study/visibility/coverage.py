"""The loop around the targets outside their stealth bounds, and its coverage of them (Sec. 4.4.3, Eq. 14)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import shapely
from shapely.geometry import LinearRing, MultiPoint, Polygon
from shapely.geometry.base import BaseGeometry

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.study.visibility.maps import FieldMap
from foveacam_pipeline.study.visibility.regions import CORNER_CHORDS, grown_obstacles

CLEARANCE_M = 0.05
"""Clearance of the path from obstacles and walls, beyond the agent's radius."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopCoverage:
    """R_cov of one loop (Eq. 14), the mean over its length of the number N of targets observed.

    `multi`: N counts every target in sight and range at once. `single_any`: N is 1 where at least one is: the
    fovea may change its target. `single_fixed`: N is 1 where one target chosen beforehand is; mean over the
    choice.
    """

    multi: float
    single_any: float
    single_fixed: float


def closed_path(
    field: FieldMap, *, inner_m: float, agent_radius_m: float, margin_m: float = 0.1
) -> LinearRing:
    """Return the loop around all targets on which the agent is unnoticed and meets no obstacle.

    It is the convex hull of the targets grown by `inner_m` + `margin_m` and cut at the walls: the shortest
    loop that keeps so far from all targets and has them inside. Where obstacles, grown by the agent's radius
    and `CLEARANCE_M`, stand in it, a group of them that touch each other is passed on its outside, or on the
    inside if the group reaches the walls. No point of it is nearer than `inner_m` to a target.

    Raise InvalidInput where there is no target, or where obstacles and stealth bounds leave no such loop.
    """
    if not field.targets_m:
        raise InvalidInput("a map without targets was given; place at least one to go around")
    if not inner_m > 0.0 or not margin_m > 0.0:
        raise InvalidInput(
            f"a stealth bound of {inner_m} m and a margin of {margin_m} m were given; both must exceed 0 m"
        )
    keep_m = agent_radius_m + CLEARANCE_M
    x0, y0, x1, y1 = field.bounds_m
    room = shapely.box(x0 + keep_m, y0 + keep_m, x1 - keep_m, y1 - keep_m)
    targets = MultiPoint(field.targets_m)
    # circumscribed, so that no chord cuts the bound
    loose = (inner_m + margin_m) / math.cos(math.pi / (8 * CORNER_CHORDS))
    inside: BaseGeometry = targets.convex_hull.buffer(loose, quad_segs=2 * CORNER_CHORDS).intersection(room)
    for group in shapely.get_parts(grown_obstacles(field, keep_m)):
        if group.intersects(inside):
            inside = inside.union(group) if group.within(room) else inside.difference(group)
    return _outline(inside, targets, inner_m)


def coverage(
    path: LinearRing, regions: Sequence[BaseGeometry], *, union: BaseGeometry | None = None
) -> LoopCoverage:
    """Return R_cov along a path by the lengths of it in each target's region, exactly (Eq. 14).

    Time is the normalised length of the path. `union` of the regions when it is known already.
    """
    if not regions:
        raise InvalidInput("the map has no target, so that nothing can be covered; place at least one")
    together = shapely.union_all(list(regions)) if union is None else union
    line = shapely.LineString(path)  # a line: the intersection of a ring with a region consists of lines too
    shares = [line.intersection(region).length / line.length for region in regions]
    return LoopCoverage(
        multi=float(sum(shares)),
        single_any=float(line.intersection(together).length / line.length),
        single_fixed=float(sum(shares) / len(shares)),
    )


def _outline(inside: BaseGeometry, targets: MultiPoint, inner_m: float) -> LinearRing:
    for part in shapely.get_parts(inside):
        if isinstance(part, Polygon) and part.covers(targets):
            path = LinearRing(part.exterior)
            if path.distance(targets) >= inner_m:
                return path
    raise InvalidInput(
        f"no loop leads around the targets {inner_m:g} m away from each: obstacles or walls close the way; "
        "lower D_min, or move targets and obstacles apart"
    )
