"""The depth of a point without texture, inferred from measured points around it.

A plane is linear in inverse depth over the tangents. Every sample is either of the target's surface or of
something in front of it; each division of the samples is a hypothesis with a probability (Bayesian linear
regression), and hypotheses that agree are put together. That all of them are in front is one more.
"""

import math
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.verge.depth_samples import DepthSamples

MAX_SAMPLES = 8
"""The nearest ones; 2 to the power of it divisions are weighed."""
LEVEL_SIGMA_PER_M = 0.3
"""Prior of 1/Z itself, about the mean of the samples."""
SLOPE_SIGMA = 1.0
"""Prior of the slope of 1/Z, relative to 1/Z and per unit of tangent: surfaces at 45 degrees are common."""
BULGE_SIGMA = 0.35
"""A surface may leave its plane by so much, relative to 1/Z and per tangent from the nearest sample: three
times that is a half sphere."""
UNEVEN_SIGMA = 2.0e-3
"""What keeps real surfaces from being planes, relative to 1/Z."""
OWN_CHANCE = 0.55
"""Chance of a sample to be of the target's surface, where nothing else is known."""
FRONT_SHARE = 0.73
"""So many of the samples that are not of the target's surface are in front of it; the rest are mismatched."""
SAME_SHARE = 0.02
"""Samples that are not the target's but lie on one surface differ by less, relative to 1/Z."""
LEAST_PROBABILITY = 0.08
"""Less probable hypotheses are not told."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Inferred:
    """One depth that the surroundings suggest: 1/Z, its standard error, and the hypothesis' probability.

    `samples`: so many of the measured points lie on the target's surface.
    """

    inverse_z_per_m: float
    sigma_per_m: float
    probability: float
    samples: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Division:
    log_weight: float
    inverse_z_per_m: float
    variance: float
    samples: int


def infer_depth(
    samples: DepthSamples, target: NDArray[np.float64], *, own_chance: NDArray[np.float64] | None = None
) -> tuple[Inferred, ...]:
    """Return what the samples suggest for a direction, (2,) tangents, the most probable first.

    `own_chance`: (n,) chance of each sample to be of the target's surface, `OWN_CHANCE` by default.
    """
    if len(samples) == 0:
        return ()
    chance = np.full(len(samples), OWN_CHANCE) if own_chance is None else own_chance
    offsets = samples.tangents - target
    nearest = np.argsort(np.hypot(*offsets.T))[:MAX_SAMPLES]
    offsets, q = offsets[nearest], samples.inverse_z_per_m[nearest]
    level = float(np.median(q))
    measured = _Measured(
        design=np.column_stack([np.ones(len(q)), offsets]),
        q=q,
        sigma=np.hypot(samples.sigma_per_m[nearest], UNEVEN_SIGMA * level),
        level=level,
        own_chance=chance[nearest],
    )
    divisions = [
        _weighed(np.array(own, dtype=np.bool_), measured)
        for own in product((True, False), repeat=len(q))
        if any(own)
    ]
    divisions.append(_all_in_front(measured))
    return _merged(divisions)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Measured:
    """The samples about a target: (n, 3) rows (1, x, y); 1/Z, its error and chance (n,); middle of 1/Z."""

    design: NDArray[np.float64]
    q: NDArray[np.float64]
    sigma: NDArray[np.float64]
    own_chance: NDArray[np.float64]
    level: float

    @property
    def prior(self) -> NDArray[np.float64]:
        slope = (SLOPE_SIGMA * self.level) ** 2
        return np.diag([LEVEL_SIGMA_PER_M**2, slope, slope])

    def log_plane(self, own: NDArray[np.bool_]) -> float:
        """Return the log marginal likelihood of some samples as points of one plane."""
        covariance = self._covariance(own)
        residual = self.q[own] - self.level
        _, log_det = np.linalg.slogdet(covariance)
        squares = float(residual @ np.linalg.solve(covariance, residual))
        return -0.5 * (squares + float(log_det) + int(own.sum()) * math.log(2.0 * math.pi))

    def log_planes(self, others: NDArray[np.bool_]) -> float:
        """Return the log likelihood of samples as points of other surfaces, sorted by depth into a few."""
        total, left = 0.0, others.copy()
        while left.any():
            nearest = float(self.q[left].min())
            same = left & (self.q <= nearest * (1.0 + SAME_SHARE) + 3.0 * self.sigma)
            total += self.log_plane(same)
            left &= ~same
        return total

    def plane(self, own: NDArray[np.bool_]) -> tuple[NDArray[np.float64], float]:
        """Return the plane through some samples, (3,) about `level`, and its variance at the target."""
        mine, prior = self.design[own], self.prior
        gain = prior @ mine.T @ np.linalg.inv(self._covariance(own))
        spread = prior - gain @ mine @ prior
        return gain @ (self.q[own] - self.level), max(float(spread[0, 0]), 0.0)

    def _covariance(self, own: NDArray[np.bool_]) -> NDArray[np.float64]:
        mine = self.design[own]
        return np.asarray(mine @ self.prior @ mine.T + np.diag(self.sigma[own] ** 2), dtype=np.float64)


def _weighed(own: NDArray[np.bool_], measured: _Measured) -> _Division:
    """Return the weight of one division of the samples, and what its own ones say of the target."""
    plane, variance = measured.plane(own)
    others, count = ~own, int(own.sum())
    ahead = measured.q[others] - (measured.level + measured.design[others] @ plane)
    in_front = ahead > -3.0 * measured.sigma[others]
    chances = (1.0 - measured.own_chance[others]) * np.where(in_front, FRONT_SHARE, 1.0 - FRONT_SHARE)
    log_weight = float(np.sum(np.log(measured.own_chance[own])) + np.sum(np.log(chances)))
    bulge = BULGE_SIGMA * measured.level * float(np.hypot(*measured.design[own, 1:].T).min())
    return _Division(
        log_weight=log_weight + measured.log_plane(own) + measured.log_planes(others),
        inverse_z_per_m=measured.level + float(plane[0]),
        variance=variance + bulge**2,
        samples=count,
    )


def _all_in_front(measured: _Measured) -> _Division:
    """Return the hypothesis that nothing measured is of the target's surface: it lies behind all of it."""
    farthest, count = float(measured.q.min()), len(measured.q)
    chances = FRONT_SHARE * (1.0 - measured.own_chance)
    return _Division(
        log_weight=float(np.sum(np.log(chances))) + measured.log_planes(np.ones(count, dtype=np.bool_)),
        inverse_z_per_m=farthest / 2.0,
        variance=farthest**2 / 12.0,
        samples=0,
    )


def _merged(divisions: list[_Division]) -> tuple[Inferred, ...]:
    """Put hypotheses together that agree within their errors; return the probable ones, best first."""
    best = max(division.log_weight for division in divisions)
    left = sorted(divisions, key=lambda division: -division.log_weight)
    total = sum(math.exp(division.log_weight - best) for division in left)
    found: list[Inferred] = []
    while left:
        head = left[0]
        group = [d for d in left if _agree(head, d)]
        left = [d for d in left if not _agree(head, d)]
        weights = np.exp([d.log_weight - best for d in group])
        probability = float(weights.sum()) / total
        if probability < LEAST_PROBABILITY:
            continue
        weights /= weights.sum()
        values = np.array([d.inverse_z_per_m for d in group])
        mean = float(weights @ values)
        variance = float(weights @ (np.array([d.variance for d in group]) + (values - mean) ** 2))
        found.append(
            Inferred(
                inverse_z_per_m=mean,
                sigma_per_m=math.sqrt(variance),
                probability=probability,
                samples=head.samples,
            )
        )
    return tuple(sorted((f for f in found if f.inverse_z_per_m > 0.0), key=lambda f: -f.probability))


def _agree(one: _Division, other: _Division) -> bool:
    apart = abs(one.inverse_z_per_m - other.inverse_z_per_m)
    return apart <= 2.0 * math.sqrt(one.variance + min(other.variance, one.variance))
