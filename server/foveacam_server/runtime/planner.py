"""The planner: ring and chances among random obstacles as plain documents. No state, no rig."""

import math
from dataclasses import dataclass

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
from foveacam_server.runtime.store import Document

CURVE_POINTS = 121
WIDER = 2.0
"""The disc that stands in for a domain is so much wider than the ring."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RingSpec:
    """What a ring is asked for by; see the REST model of the same fields."""

    feature_m: float
    px_per_deg: float
    pixels: float
    small_angle: bool
    d_min_m: float
    near_error_m: float
    bound: str

    @property
    def resolution_rad(self) -> float:
        """The angle that the feature must fill."""
        return resolution_rad(self.px_per_deg, pixels=self.pixels)

    def ring(self) -> StandoffRing:
        """Return where an observer may stand (Eqs. 6-9)."""
        angle_rad = self.resolution_rad
        if angle_rad >= math.pi:
            raise InvalidInput(
                f"{self.pixels:g} pixels at {self.px_per_deg:g} px per degree are an angle of"
                f" {math.degrees(angle_rad):.4g}°; less than 180° is possible: ask for fewer pixels",
                asked=f"{self.pixels:g} pixels on the feature",
            )
        d_max_m = resolving_range_m(self.feature_m, angle_rad, small_angle=self.small_angle)
        bound = NearBound(self.bound)
        return standoff_ring(self.d_min_m, d_max_m, near_error_m=self.near_error_m, bound=bound)


def ring_document(wish: RingSpec) -> Document:
    """Return the ring, and in words why it is empty where it is."""
    found = wish.ring()
    return {
        "resolution_mrad": 1e3 * wish.resolution_rad,
        "d_max_m": found.outer_m,
        "inner_m": found.inner_m,
        "outer_m": found.outer_m,
        "empty": found.empty,
        "empty_because": why_empty(wish, found) if found.empty else None,
        "area_m2": found.area_m2,
    }


def why_empty(wish: RingSpec, found: StandoffRing) -> str:
    """Say why nobody can stand anywhere (Eq. 7), and what would help."""
    error = NearBound(wish.bound) is not NearBound.PLAIN and wish.near_error_m > 0.0
    near = (
        f"D_min with its depth error ({found.inner_m:.4g} m)" if error else f"D_min ({found.inner_m:.4g} m)"
    )
    return (
        f"{near} is at or beyond D_max ({found.outer_m:.4g} m): no place is left. A larger feature, fewer"
        " pixels on it or a finer resolution move D_max out; a smaller D_min moves the other bound in."
    )


def standoff_document(wish: RingSpec, clutter: RandomObstacles, *, domain_m2: float | None) -> Document:
    """Return the ring, the chances among random obstacles, and the curve of Eq. 12 over the same domain."""
    found = wish.ring()
    reach_m = found.inner_m if found.empty else found.outer_m
    domain_m2 = math.pi * (WIDER * reach_m) ** 2 if domain_m2 is None else domain_m2
    if not domain_m2 > 0.0:
        raise InvalidInput(f"a ring of {reach_m:g} m is too small for a domain of its own; say domain_m2")
    success = success_probability(found, clutter, domain_m2=domain_m2)
    slope = 0.0 if found.empty else success_slope_per_m(found.outer_m, clutter, domain_m2=domain_m2)
    clear = clear_probability([found.inner_m, found.outer_m], clutter)
    return {
        "ring": ring_document(wish),
        "domain_m2": domain_m2,
        "corridor_m2": float(corridor_m2(found.outer_m, clutter.radius_m)),
        "clear_at_inner": float(clear[0]),
        "clear_at_outer": float(clear[1]),
        "success": success,
        "success_slope_per_m": slope,
        "expected_area_m2": success * domain_m2,
        "curve": _curve(found.inner_m, clutter, domain_m2),
    }


def _curve(inner_m: float, clutter: RandomObstacles, domain_m2: float) -> Document:
    """Return Eq. 12 for every D_max that the domain holds."""
    last_m = math.sqrt(domain_m2 / math.pi)
    reaches_m = [last_m * index / (CURVE_POINTS - 1) for index in range(CURVE_POINTS)]
    rings = [StandoffRing(inner_m=inner_m, outer_m=reach_m) for reach_m in reaches_m]
    return {
        "d_max_m": reaches_m,
        "success": [success_probability(each, clutter, domain_m2=domain_m2) for each in rings],
        "clear": [float(value) for value in clear_probability(reaches_m, clutter)],
    }
