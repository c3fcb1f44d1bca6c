"""Lines of sight among random obstacles (Sec. 4.4.2, Eqs. 10-13), in closed form and by Monte Carlo.

Centres of obstacles are a homogeneous Poisson process in the plane, its rate -ln(1 - p) for an occupancy p
per unit area. An obstacle hides the target when its centre is within its radius of the line of sight.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.study.visibility.standoff import StandoffRing


@dataclass(frozen=True, slots=True, kw_only=True)
class RandomObstacles:
    """Random obstacles: `occupancy` p per square metre, each of radius `radius_m`."""

    occupancy: float
    radius_m: float

    def __post_init__(self) -> None:
        """Refuse an occupancy outside 0 to 1 and a negative radius."""
        if not 0.0 <= self.occupancy <= 1.0:
            raise InvalidInput(f"an occupancy p of {self.occupancy} was given; a probability is 0 to 1")
        if not 0.0 <= self.radius_m < math.inf:
            raise InvalidInput(f"an obstacle radius of {self.radius_m} m was given; 0 m or more is possible")

    @property
    def rate_per_m2(self) -> float:
        """Rate of the Poisson process; infinite for p = 1."""
        return math.inf if self.occupancy == 1.0 else -math.log1p(-self.occupancy)


@dataclass(frozen=True, slots=True, kw_only=True)
class SampledProbability:
    """A probability estimated by Monte Carlo, with its standard error."""

    value: float
    sigma: float
    trials: int


def corridor_m2(distance_m: ArrayLike, radius_m: float) -> NDArray[np.float64]:
    """Return the area in which an obstacle's centre blocks a line of that length (Eq. 10)."""
    return np.asarray(2.0 * radius_m * np.asarray(distance_m) + math.pi * radius_m**2, dtype=np.float64)


def clear_probability(distance_m: ArrayLike, clutter: RandomObstacles) -> NDArray[np.float64]:
    """Return the probability that no obstacle blocks a line of that length (Eq. 11)."""
    return np.asarray((1.0 - clutter.occupancy) ** corridor_m2(distance_m, clutter.radius_m))


def success_probability(ring: StandoffRing, clutter: RandomObstacles, *, domain_m2: float) -> float:
    """Return the probability that an observer anywhere in the domain sees the target unnoticed (Eq. 12).

    In closed form: the integral of x exp(-a x) is the incomplete gamma function of 2. The target's whole ring
    lies in the domain; raise InvalidInput where it cannot.
    """
    from scipy.special import gammainc  # slow to import, and the server imports this module at its start

    _check_domain(ring, domain_m2)
    if ring.empty:
        return 0.0
    decay = 2.0 * clutter.rate_per_m2 * clutter.radius_m if clutter.radius_m > 0.0 else 0.0
    if math.isinf(decay):
        return 0.0
    if decay * ring.outer_m < 1e-100:  # practically no obstacle: the square of the decay would underflow
        integral = (ring.outer_m**2 - ring.inner_m**2) / 2.0
    else:
        inner, outer = gammainc(2.0, decay * np.array([ring.inner_m, ring.outer_m]))
        integral = float(outer - inner) / decay**2
    nearest = float(clear_probability(0.0, clutter))
    return float(2.0 * math.pi / domain_m2 * nearest * integral)


def success_slope_per_m(d_max_m: float, clutter: RandomObstacles, *, domain_m2: float) -> float:
    """Return the derivative of the probability of success by D_max, per m, never negative (Eq. 13)."""
    return 2.0 * math.pi * d_max_m / domain_m2 * float(clear_probability(d_max_m, clutter))


def sample_success(
    ring: StandoffRing, clutter: RandomObstacles, *, domain_m2: float, trials: int, rng: np.random.Generator
) -> SampledProbability:
    """Return the share of random observers in a disc of the domain's area that see the target unnoticed.

    Obstacles are drawn anew for every observer, in the rectangle in which one could block its line: a Poisson
    process is Poisson in every part of the plane. Of the formulas above only the rate is used.
    """
    _check_domain(ring, domain_m2)
    if trials < 1:
        raise InvalidInput(f"{trials} trials were asked for; at least 1 is needed")
    if math.isinf(clutter.rate_per_m2):
        raise InvalidInput(
            "an occupancy of 1 fills the plane: nothing can be drawn at random; choose less than 1"
        )
    distance_m = np.sqrt(rng.uniform(0.0, domain_m2 / math.pi, trials))
    inside = distance_m[(distance_m > ring.inner_m) & (distance_m < ring.outer_m)]
    seen = int(np.count_nonzero(~_blocked(inside, clutter, rng)))
    return _estimate(seen, trials)


def sample_corridor_share(
    distance_m: float, radius_m: float, *, trials: int, rng: np.random.Generator
) -> SampledProbability:
    """Return the corridor's share of its bounding box, (d + 2 r) by 2 r, by random points (Eq. 10)."""
    along_m = rng.uniform(-radius_m, distance_m + radius_m, trials)
    across_m = rng.uniform(-radius_m, radius_m, trials)
    hit = _near(along_m, across_m, np.full(trials, distance_m), radius_m)
    return _estimate(int(np.count_nonzero(hit)), trials)


def sample_clear_share(
    distance_m: float, clutter: RandomObstacles, *, trials: int, rng: np.random.Generator
) -> SampledProbability:
    """Return how often no obstacle blocks a line of that length, with new obstacles for each (Eq. 11)."""
    blocked = _blocked(np.full(trials, distance_m), clutter, rng)
    return _estimate(int(np.count_nonzero(~blocked)), trials)


def _estimate(hits: int, trials: int) -> SampledProbability:
    value = hits / trials
    return SampledProbability(value=value, sigma=math.sqrt(value * (1.0 - value) / trials), trials=trials)


def _blocked(
    lengths_m: NDArray[np.float64], clutter: RandomObstacles, rng: np.random.Generator
) -> NDArray[np.bool_]:
    """Return for each line whether it is blocked, with new obstacles for each."""
    r_m = clutter.radius_m
    counts = rng.poisson(clutter.rate_per_m2 * (lengths_m + 2.0 * r_m) * 2.0 * r_m)
    line = np.repeat(np.arange(len(lengths_m)), counts)
    along_m = rng.uniform(-r_m, lengths_m[line] + r_m)
    across_m = rng.uniform(-r_m, r_m, len(line))
    hit = _near(along_m, across_m, lengths_m[line], r_m)
    return np.asarray(np.bincount(line[hit], minlength=len(lengths_m)) > 0)


def _near(
    along_m: NDArray[np.float64],
    across_m: NDArray[np.float64],
    lengths_m: NDArray[np.float64],
    radius_m: float,
) -> NDArray[np.bool_]:
    """Return whether each point is nearer than the radius to the line from 0 to its length."""
    beyond_m = np.maximum(0.0, np.maximum(-along_m, along_m - lengths_m))
    return np.asarray(np.hypot(beyond_m, across_m) < radius_m)


def _check_domain(ring: StandoffRing, domain_m2: float) -> None:
    least_m2 = 0.0 if ring.empty else math.pi * ring.outer_m**2
    if not domain_m2 > 0.0 or domain_m2 < least_m2 * (1.0 - 1e-12):
        raise InvalidInput(
            f"a domain of {domain_m2:g} m² was given; the target's ring needs more than {least_m2:g} m²"
        )
