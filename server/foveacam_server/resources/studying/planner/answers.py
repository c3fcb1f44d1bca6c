"""Computes the planner's answers about one target: the stand-off ring and the probability of success.

Pure functions over the pipeline's study; needs no rig.
"""

import math

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.study.visibility.obstacles import (
    RandomObstacles,
    clear_probability,
    corridor_m2,
    success_probability,
    success_slope_per_m,
)
from foveacam_pipeline.study.visibility.standoff import (
    NearBound,
    StandoffRing,
    resolution_rad,
    resolving_range_m,
    standoff_ring,
)
from foveacam_server.resources.studying.planner.schema import (
    ClutterRequest,
    CurveDocument,
    RingDocument,
    RingRequest,
    StandoffDocument,
    StandoffRequest,
)

CURVE_POINTS = 121
DOMAIN_FACTOR = 2.0
"""Without a domain in the request, it is a disc of this many times the ring's outer radius."""


def requested_ring(request: RingRequest) -> StandoffRing:
    """Return where an observer may stand (Eqs. 6-9); raise `InvalidInput` for an angle of 180° or more."""
    angle_rad = _resolution_rad(request)
    if angle_rad >= math.pi:
        raise InvalidInput(
            f"{request.pixels:g} pixels at {request.px_per_deg:g} px per degree are an angle of"
            f" {math.degrees(angle_rad):.4g}°; less than 180° is possible: ask for fewer pixels",
            asked=f"{request.pixels:g} pixels on the feature",
        )
    feature_m = request.feature_mm / 1000.0
    d_max_m = resolving_range_m(feature_m, angle_rad, small_angle=request.small_angle)
    bound = NearBound(request.bound)
    return standoff_ring(request.d_min_m, d_max_m, near_error_m=request.near_error_m, bound=bound)


def describe_ring(request: RingRequest) -> RingDocument:
    """Return the ring of a request; for an empty one, with the reason in words."""
    found = requested_ring(request)
    return RingDocument(
        resolution_mrad=1e3 * _resolution_rad(request),
        d_max_m=found.outer_m,
        inner_m=found.inner_m,
        outer_m=found.outer_m,
        empty=found.empty,
        empty_because=_why_empty(request, found) if found.empty else None,
        area_m2=found.area_m2,
    )


def _resolution_rad(request: RingRequest) -> float:
    """Return the angle that the feature must fill."""
    return resolution_rad(request.px_per_deg, pixels=request.pixels)


def _why_empty(request: RingRequest, found: StandoffRing) -> str:
    """Return why the ring is empty (Eq. 7) and what would change that."""
    error = NearBound(request.bound) is not NearBound.PLAIN and request.near_error_m > 0.0
    near = (
        f"D_min with its depth error ({found.inner_m:.4g} m)" if error else f"D_min ({found.inner_m:.4g} m)"
    )
    return (
        f"{near} is at or beyond D_max ({found.outer_m:.4g} m): no place is left. A larger feature, fewer"
        " pixels on it or a finer resolution move D_max out; a smaller D_min moves the other bound in."
    )


def describe_standoff(request: StandoffRequest) -> StandoffDocument:
    """Return the ring, the chances among random obstacles, and the curve of Eq. 12 over the same domain."""
    found, clutter = requested_ring(request.ring), _obstacles(request.clutter)
    reach_m = found.inner_m if found.empty else found.outer_m
    domain_m2 = math.pi * (DOMAIN_FACTOR * reach_m) ** 2 if request.domain_m2 is None else request.domain_m2
    if not domain_m2 > 0.0:
        raise InvalidInput(f"a ring of {reach_m:g} m is too small for a domain of its own; set domain_m2")
    success = success_probability(found, clutter, domain_m2=domain_m2)
    slope = 0.0 if found.empty else success_slope_per_m(found.outer_m, clutter, domain_m2=domain_m2)
    clear = clear_probability([found.inner_m, found.outer_m], clutter)
    return StandoffDocument(
        ring=describe_ring(request.ring),
        domain_m2=domain_m2,
        corridor_m2=float(corridor_m2(found.outer_m, clutter.radius_m)),
        clear_at_inner=float(clear[0]),
        clear_at_outer=float(clear[1]),
        success=success,
        success_slope_per_m=slope,
        expected_area_m2=success * domain_m2,
        curve=_curve(found.inner_m, clutter, domain_m2),
    )


def _obstacles(request: ClutterRequest) -> RandomObstacles:
    return RandomObstacles(occupancy=request.occupancy, radius_m=request.radius_m)


def _curve(inner_m: float, clutter: RandomObstacles, domain_m2: float) -> CurveDocument:
    """Return the curve of Eq. 12 over D_max, up to the largest that fits into the domain."""
    last_m = math.sqrt(domain_m2 / math.pi)
    reaches_m = [last_m * index / (CURVE_POINTS - 1) for index in range(CURVE_POINTS)]
    rings = [StandoffRing(inner_m=inner_m, outer_m=reach_m) for reach_m in reaches_m]
    return CurveDocument(
        d_max_m=reaches_m,
        success=[success_probability(each, clutter, domain_m2=domain_m2) for each in rings],
        clear=[float(value) for value in clear_probability(reaches_m, clutter)],
    )
