"""Eq. 12 by adaptive quadrature, to judge its closed form."""

import math

from scipy.integrate import quad

from foveacam_pipeline.study.visibility.obstacles import RandomObstacles, clear_probability
from foveacam_pipeline.study.visibility.standoff import StandoffRing


def success_by_quadrature(ring: StandoffRing, clutter: RandomObstacles, *, domain_m2: float) -> float:
    """Return the probability that a random observer of the domain sees the target unnoticed."""
    integral, _ = quad(
        lambda r_m: float(clear_probability(r_m, clutter)) * r_m,
        ring.inner_m,
        max(ring.inner_m, ring.outer_m),
        epsrel=1e-10,
        limit=200,
    )
    return 2.0 * math.pi / domain_m2 * float(integral)
