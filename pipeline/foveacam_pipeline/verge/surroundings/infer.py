"""The depth of a point without texture, inferred from measured points around it.

A plane is linear in inverse depth over the tangents. Every sample is of the target's surface or of another
one, mostly in front of it; each division of the samples is a hypothesis with a probability (`planes.py`),
and hypotheses that agree are put together. That all samples are in front is one more.
"""

import math
from dataclasses import dataclass
from itertools import product
from statistics import median

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.verge.surroundings.depth_samples import DepthSamples
from foveacam_pipeline.verge.surroundings.planes import PlaneHypotheses, planes_through, subset_of

MAX_SAMPLES = 8
"""The nearest ones; 2 to the power of it divisions are weighed."""
BULGE_SIGMA = 0.35
"""A surface may leave its plane by so much, relative to 1/Z and per tangent from the nearest sample: three
times that is a half sphere."""
UNEVEN_SIGMA = 2.0e-3
"""What keeps real surfaces from being planes, relative to 1/Z."""
OWN_CHANCE = 0.55
"""Chance of a sample to be of the target's surface, where nothing else is known."""
FRONT_SHARE = 0.87
"""So many of the edges about a blank region that are not its own are in front of it: an edge moves with the
nearer surface, so one behind it is a mismatch."""
EVEN_SHARE = 0.5
"""What lies about a point with texture is as often in front of it as behind it."""
ENCLOSING_CHANCE, ENCLOSING_SAMPLES = 0.92, 4
"""Chance of a surface that surrounds the target with so many samples to be its own."""
HOLDING_SAMPLES = 3
"""A surface that is measured in so many directions is not one place's error."""
NEAR_CHANCE = 0.3
"""A point of a smaller chance lies beyond the target's region, and surrounds nothing."""
NEXT_TAN = 1.0e-3
"""A point so near to the target is next to it: three wide px."""
SURE_CHANCE = 0.9
"""A point of such a chance is sure to be of the target's surface."""
NOTHING_CHANCE = 0.08
"""Chance that nothing that was measured about a target is of its surface."""
SAME_SHARE = 0.02
"""Samples that are not the target's but lie on one surface differ by less, relative to 1/Z."""
LEAST_PROBABILITY = 0.08
"""Less probable hypotheses are not told."""


@dataclass(frozen=True, slots=True, kw_only=True)
class InferredDepth:
    """One depth that the surroundings suggest: 1/Z, its standard error, and the hypothesis' probability.

    `samples`: so many of the measured points lie on the target's surface. `owned`: whether one of them is
    next to the target or sure to be of its surface. `held`: whether one is, or they surround the target, if
    need be with what lies in front of them.
    """

    inverse_z_per_m: float
    sigma_per_m: float
    probability: float
    samples: int
    owned: bool
    held: bool


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Division:
    log_weight: float
    inverse_z_per_m: float
    variance: float
    samples: int
    owned: bool
    held: bool


def infer_depth(
    samples: DepthSamples,
    target: NDArray[np.float64],
    *,
    own_chance: NDArray[np.float64] | None = None,
    blank: bool = True,
) -> tuple[InferredDepth, ...]:
    """Return what the samples suggest for a direction, (2,) tangents, the most probable first.

    `own_chance`: (n,) chance of each sample to be of the target's surface, `OWN_CHANCE` by default.
    `blank`: whether the target is within a blank region, on whose border the samples lie.
    """
    if len(samples) == 0:
        return ()
    chance = np.full(len(samples), OWN_CHANCE) if own_chance is None else own_chance
    offsets = samples.tangents - target
    nearest = np.argsort(np.hypot(*offsets.T))[:MAX_SAMPLES]
    offsets, q = offsets[nearest], samples.inverse_z_per_m[nearest]
    level = float(np.median(q))
    sigma = np.hypot(samples.sigma_per_m[nearest], UNEVEN_SIGMA * level)
    measured = _Measured(
        offsets=offsets,
        q=q,
        sigma=sigma,
        own_chance=chance[nearest],
        level=level,
        blank=blank,
        planes=planes_through(offsets, q, sigma, level=level),
        log_other=np.log(1.0 - chance[nearest]),
    )
    divisions = [
        division
        for own in product((True, False), repeat=len(q))
        if any(own)
        for division in _weighed(np.array(own, dtype=np.bool_), measured)
    ]
    divisions.append(_all_in_front(measured))
    return _merged(divisions)


class LastInference:
    """Keeps the last inference: most looks add no sample, and then it is still valid."""

    def __init__(self) -> None:
        self._given: tuple[NDArray[np.float64], bool] | None = None
        self._inferred: tuple[InferredDepth, ...] = ()

    def infer(
        self,
        samples: DepthSamples,
        target: NDArray[np.float64],
        own_chance: NDArray[np.float64],
        *,
        blank: bool,
    ) -> tuple[InferredDepth, ...]:
        """Return `infer_depth` of the samples."""
        offsets = samples.tangents - target
        table = np.column_stack([offsets, samples.inverse_z_per_m, samples.sigma_per_m, own_chance])
        if self._given is None or self._given[1] != blank or not np.array_equal(self._given[0], table):
            self._inferred = infer_depth(samples, target, own_chance=own_chance, blank=blank)
            self._given = table, blank
        return self._inferred


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Measured:
    """The samples about a target: (n, 2) offsets; 1/Z, its error and chance (n,); middle of 1/Z; planes."""

    offsets: NDArray[np.float64]
    q: NDArray[np.float64]
    sigma: NDArray[np.float64]
    own_chance: NDArray[np.float64]
    level: float
    blank: bool
    planes: PlaneHypotheses
    log_other: NDArray[np.float64]
    """(n,) log chance of each not to be of the target's surface."""

    def front_share(self) -> float:
        """Return how many of the surfaces that are not the target's are in front of it."""
        return FRONT_SHARE if self.blank else EVEN_SHARE

    def behind_share(self, samples: int) -> float:
        """Return how many are behind it. An edge there is a mismatch, and those seldom agree."""
        return (1.0 - FRONT_SHARE) / samples if self.blank else 1.0 - EVEN_SHARE

    def surfaces(self, others: NDArray[np.bool_]) -> list[NDArray[np.bool_]]:
        """Sort samples by depth into surfaces."""
        found, left = [], others.copy()
        while left.any():
            nearest = float(self.q[left].min())
            same = left & (self.q <= nearest * (1.0 + SAME_SHARE) + 3.0 * self.sigma)
            found.append(same)
            left &= ~same
        return found

    def own_log_chance(self, own: NDArray[np.bool_]) -> float:
        """Return the log chance that a surface is the target's; one that encloses it has a large one."""
        chance = math.log(float(self.own_chance[own].max()))
        near = own & (self.own_chance >= NEAR_CHANCE)
        return max(chance, math.log(ENCLOSING_CHANCE)) if encloses(self.offsets[near]) else chance

    def owns(self, own: NDArray[np.bool_]) -> bool:
        """Return whether one of some samples is next to the target or sure to be of its surface."""
        next_to = float(np.hypot(*self.offsets[own].T).min()) <= NEXT_TAN
        return next_to or float(self.own_chance[own].max()) >= SURE_CHANCE

    def surrounds(self, own: NDArray[np.bool_]) -> bool:
        """Return whether samples surround the target with what lies in front, which hides where they end."""
        in_front = self.q > float(self.q[own].max())
        return int(own.sum()) >= HOLDING_SAMPLES and encloses(self.offsets[own | in_front])

    def other_log_weight(self, surface: NDArray[np.bool_], share: float) -> float:
        """Return the log weight of one surface that is not the target's.

        `share`: of such surfaces on its side of the target's.
        """
        chance = float(self.log_other[surface].min())
        return chance + math.log(share) + float(self.planes.log_any[subset_of(surface)])


def encloses(offsets: NDArray[np.float64]) -> bool:
    """Return whether points at (n, 2) offsets from a target lie about it with no gap of half a turn."""
    if len(offsets) < ENCLOSING_SAMPLES:
        return False
    turns = np.sort(np.arctan2(offsets[:, 1], offsets[:, 0]))
    return float(np.diff(np.append(turns, turns[0] + 2.0 * np.pi)).max()) < np.pi


def spread_per_m(inferred: tuple[InferredDepth, ...]) -> float:
    """Return the root mean square distance of all depths from the most probable, errors included."""
    best, total = inferred[0].inverse_z_per_m, sum(one.probability for one in inferred)
    variance = sum(
        one.probability / total * (one.sigma_per_m**2 + (one.inverse_z_per_m - best) ** 2) for one in inferred
    )
    return math.sqrt(variance)


def _weighed(own: NDArray[np.bool_], measured: _Measured) -> list[_Division]:
    """Return the weight of one division of the samples, and what its own ones say, for each prior."""
    planes, subset = measured.planes, subset_of(own)
    owned, chance = measured.owns(own), measured.own_log_chance(own)
    held = owned or measured.surrounds(own)
    others = measured.surfaces(~own)
    bulge = BULGE_SIGMA * measured.level * float(np.hypot(*measured.offsets[own].T).min())
    found = []
    for k, plane in enumerate(planes.plane[:, subset]):
        log_weight = chance + float(planes.log_evidence[k, subset])
        for surface in others:
            expected = measured.level + plane[0] + measured.offsets[surface] @ plane[1:]
            ahead = measured.q[surface] - expected + 3.0 * measured.sigma[surface]
            in_front = median(ahead.tolist()) > 0.0
            share = measured.front_share() if in_front else measured.behind_share(int(surface.sum()))
            log_weight += measured.other_log_weight(surface, share)
        found.append(
            _Division(
                log_weight=log_weight,
                inverse_z_per_m=measured.level + float(plane[0]),
                variance=float(planes.variance[k, subset]) + bulge**2,
                samples=int(own.sum()),
                owned=owned,
                held=held,
            )
        )
    return found


def _all_in_front(measured: _Measured) -> _Division:
    """Return the hypothesis that nothing measured is of the target's surface: it lies behind all of it."""
    farthest = float(measured.q.min())
    log_weight = sum(
        measured.other_log_weight(surface, measured.front_share())
        for surface in measured.surfaces(np.ones(len(measured.q), dtype=np.bool_))
    )
    return _Division(
        log_weight=log_weight + math.log(NOTHING_CHANCE),
        inverse_z_per_m=farthest / 2.0,
        variance=farthest**2 / 12.0,
        samples=0,
        owned=False,
        held=False,
    )


def _merged(divisions: list[_Division]) -> tuple[InferredDepth, ...]:
    """Put hypotheses together that agree within their errors; return the probable ones, best first."""
    best = max(division.log_weight for division in divisions)
    left = sorted(divisions, key=lambda division: -division.log_weight)
    total = sum(math.exp(division.log_weight - best) for division in left)
    found: list[InferredDepth] = []
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
            InferredDepth(
                inverse_z_per_m=mean,
                sigma_per_m=math.sqrt(variance),
                probability=probability,
                samples=head.samples,
                owned=head.owned,
                held=head.held,
            )
        )
    return tuple(sorted((f for f in found if f.inverse_z_per_m > 0.0), key=lambda f: -f.probability))


def _agree(one: _Division, other: _Division) -> bool:
    apart = abs(one.inverse_z_per_m - other.inverse_z_per_m)
    return apart <= 2.0 * math.sqrt(one.variance + min(other.variance, one.variance))
