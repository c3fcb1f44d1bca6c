"""The stand-off ring around a target (Sec. 4.4.1, Eqs. 6-9): the range that resolves a feature, less D_min.

An observer closer than `d_min_m` is noticed; one farther than `d_max_m` does not resolve the feature.
"""

import math
from dataclasses import dataclass
from enum import StrEnum

from foveacam_hardware.contract import InvalidInput


class NearBound(StrEnum):
    """How the observer's own depth error changes the inner bound.

    Eq. 9 as printed subtracts the error from D_min, although the text says that it inflates the stealth
    bound. An observer that must not come nearer than D_min stays farther away by the error of its distance:
    plots use `INFLATED`.
    """

    PLAIN = "plain"
    INFLATED = "inflated"
    AS_PRINTED = "as_printed"


@dataclass(frozen=True, slots=True, kw_only=True)
class StandoffRing:
    """Radii between which an observer may be, m; empty where the bounds meet or cross (Eq. 7)."""

    inner_m: float
    outer_m: float

    @property
    def empty(self) -> bool:
        """Return whether the ring is empty."""
        return self.inner_m >= self.outer_m

    @property
    def area_m2(self) -> float:
        """Area without any obstacle: pi (outer² - inner²), 0 where empty (Sec. 4.4.1)."""
        return 0.0 if self.empty else math.pi * (self.outer_m**2 - self.inner_m**2)


def resolution_rad(px_per_deg: float, *, pixels: float = 1.0) -> float:
    """Return the angle, rad, that a resolved feature fills: a number of a camera's pixels (Table 2)."""
    if not px_per_deg > 0.0 or not pixels > 0.0:
        raise InvalidInput(f"{px_per_deg} px per degree and {pixels} pixels were given; both must exceed 0")
    return math.radians(pixels / px_per_deg)


def resolving_range_m(feature_m: float, resolution: float, *, small_angle: bool = False) -> float:
    """Return D_max, m, at which a feature of `feature_m` fills the angle `resolution`, rad (Eq. 6).

    `small_angle`: by the approximation S / theta. Raise InvalidInput unless size and angle exceed 0.
    """
    if not feature_m > 0.0:
        raise InvalidInput(f"a feature of {feature_m} m was given; its size must exceed 0 m")
    if not 0.0 < resolution < math.pi:
        raise InvalidInput(
            f"an angular resolution of {resolution} rad was given; choose one between 0 and pi"
        )
    return feature_m / resolution if small_angle else feature_m / (2.0 * math.tan(resolution / 2.0))


def standoff_ring(
    d_min_m: float, d_max_m: float, *, near_error_m: float = 0.0, bound: NearBound = NearBound.INFLATED
) -> StandoffRing:
    """Return the ring with the depth error `near_error_m` applied to its inner bound (Eqs. 7-9).

    D_min at or beyond D_max gives an empty ring, not an error.
    """
    for name, value in (("D_min", d_min_m), ("D_max", d_max_m), ("the depth error", near_error_m)):
        if not 0.0 <= value < math.inf:
            raise InvalidInput(f"{name} of {value} m was given; 0 m or more is possible")
    change_m = {NearBound.PLAIN: 0.0, NearBound.INFLATED: near_error_m, NearBound.AS_PRINTED: -near_error_m}
    return StandoffRing(inner_m=max(0.0, d_min_m + change_m[bound]), outer_m=d_max_m)
