"""Weights of every division of a few samples into those of the target's surface and those of others.

The weight of a division is the marginal likelihood of a plane through the own samples, of planes through the
others, and the chance of each surface to be the target's or not.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.verge.surroundings.planes import PlaneHypotheses, planes_through, subset_of

BULGE_SIGMA = 0.35
"""Standard deviation of a surface from its plane, relative to 1/Z and per tangent from the nearest sample:
three times that is a half sphere."""
FRONT_SHARE = 0.87
"""Share of the foreign edges about a blank region that lie in front of it: an edge belongs to the nearer
surface, so one behind it is a mismatch."""
EVEN_SHARE = 0.5
"""The same about a point with texture: as often in front of it as behind it."""
ENCLOSING_CHANCE, ENCLOSING_SAMPLES = 0.92, 4
"""Chance that a surface is the target's if it surrounds it, and the number of samples needed for that."""
HOLDING_SAMPLES = 3
"""Least number of directions in which a surface is measured, so that it is not one place's error."""
NEAR_CHANCE = 0.3
"""A point with a smaller chance lies beyond the target's region, and surrounds nothing."""
NEXT_TAN = 1.0e-3
"""Distance within which a point counts as next to the target: three wide px."""
SURE_CHANCE = 0.9
"""Chance from which a point counts as certain to be of the target's surface."""
NOTHING_CHANCE = 0.08
"""Chance that no measured sample is of the target's surface, where several surfaces are measured: 4 of 69
clicks whose edges could all belong to something else."""
ALONE_NOTHING_CHANCE = 0.7
"""The same where only one surface is measured, and no sample is likelier than not to be of the target's: of
41 such clicks that the surface did not surround, 20 were on it."""
SAME_SHARE = 0.02
"""Foreign samples whose 1/Z differ by less, relative to 1/Z, lie on one surface."""

Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NearSamples:
    """The samples about a target.

    `offsets`: (n, 2) from it, tangents. `q`, `sigma`: (n,) 1/Z and its error. `own_chance`: (n,) of being of
    its surface. `level`: a common 1/Z. `blank`: whether it is in a blank region, on whose border they lie.
    """

    offsets: NDArray[np.float64]
    q: NDArray[np.float64]
    sigma: NDArray[np.float64]
    own_chance: NDArray[np.float64]
    level: float
    blank: bool


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Divisions:
    """Hypotheses on the target from (m,) divisions.

    `samples`: number of own samples; `owned`, `held`: as in `InferredDepth`.
    """

    log_weight: NDArray[np.float64]
    inverse_z_per_m: NDArray[np.float64]
    variance: NDArray[np.float64]
    samples: NDArray[np.int64]
    owned: Mask
    held: Mask


def weigh_divisions(near: NearSamples) -> Divisions:
    """Return all divisions under each prior of the slope; in the last one no sample is the target's."""
    planes = planes_through(near.offsets, near.q, near.sigma, level=near.level)
    count = len(near.q)
    own = np.asarray((np.arange(1, 2**count)[:, None] >> np.arange(count)) & 1, dtype=np.bool_)
    slopes = planes.plane[:, 1:]
    expected = near.level + slopes[..., :1] + slopes[..., 1:] @ near.offsets.T
    ahead = near.q + 3.0 * near.sigma - expected
    log_weight = _own_log_chance(near, own) + planes.log_evidence[:, 1:]
    for surface in _surfaces(near, ~own):
        log_weight += _other_log_weight(near, planes, surface, in_front=_middle(ahead, surface) > 0.0)
    distance = np.where(own, np.hypot(*near.offsets.T), np.inf).min(axis=1)
    own_chance = np.where(own, near.own_chance, 0.0).max(axis=1)
    owned = (distance <= NEXT_TAN) | (own_chance >= SURE_CHANCE)
    variance = planes.variance[:, 1:] + (BULGE_SIGMA * near.level * distance) ** 2
    priors = len(log_weight)
    farthest = float(near.q.min())
    return Divisions(
        log_weight=np.append(log_weight, _nothing_log_weight(near, planes)),
        inverse_z_per_m=np.append(near.level + slopes[..., 0], farthest / 2.0),
        variance=np.append(variance, farthest**2 / 12.0),
        samples=np.append(np.tile(own.sum(axis=1), priors), 0),
        owned=np.append(np.tile(owned, priors), False),
        held=np.append(np.tile(owned | _surrounded(near, own), priors), False),
    )


def enclose(offsets: NDArray[np.float64], subsets: Mask) -> Mask:
    """Return (m,) whether (m, n) subsets of points at (n, 2) offsets leave no gap of half a turn about 0."""
    turns = np.arctan2(offsets[:, 1], offsets[:, 0])
    order = np.argsort(turns)
    widest = np.zeros(len(subsets))
    first, last = np.full(len(subsets), np.nan), np.full(len(subsets), np.nan)
    for index in order:
        within = subsets[:, index]
        gap = np.where(within & ~np.isnan(last), turns[index] - last, 0.0)
        widest = np.maximum(widest, gap)
        first = np.where(within & np.isnan(first), turns[index], first)
        last = np.where(within, turns[index], last)
    widest = np.fmax(widest, first + 2.0 * np.pi - last)
    return np.asarray((subsets.sum(axis=1) >= ENCLOSING_SAMPLES) & (widest < np.pi))


def _surfaces(near: NearSamples, others: Mask) -> list[Mask]:
    """Group the samples of each of (m, n) subsets by depth into surfaces, the farthest first."""
    found, left = [], others.copy()
    while left.any():
        farthest = np.where(left, near.q, np.inf).min(axis=1, keepdims=True)
        same = left & (near.q <= farthest * (1.0 + SAME_SHARE) + 3.0 * near.sigma)
        found.append(same)
        left &= ~same
    return found


def _own_log_chance(near: NearSamples, own: Mask) -> NDArray[np.float64]:
    """Return (m,) log chance that a surface is the target's; it is large for one that encloses it."""
    chance = np.where(own, near.own_chance, 0.0).max(axis=1)
    encloses = enclose(near.offsets, own & (near.own_chance >= NEAR_CHANCE))
    return np.asarray(np.log(np.where(encloses, np.maximum(chance, ENCLOSING_CHANCE), chance)))


def _surrounded(near: NearSamples, own: Mask) -> Mask:
    """Return (m,) whether own samples surround the target, with nearer ones that may hide the rest."""
    nearest = np.where(own, near.q, -np.inf).max(axis=1, keepdims=True)
    several = np.asarray(own.sum(axis=1) >= HOLDING_SAMPLES)
    return several & enclose(near.offsets, own | (near.q > nearest))


def _other_log_weight(
    near: NearSamples, planes: PlaneHypotheses, surface: Mask, *, in_front: Mask
) -> NDArray[np.float64]:
    """Return the log weight of a surface, (m, n), that is not the target's; 0 where it is empty.

    `in_front`: (..., m) whether it lies in front of the target's. Surfaces behind an edge are mismatches,
    which seldom agree.
    """
    count = surface.sum(axis=1)
    front = FRONT_SHARE if near.blank else EVEN_SHARE
    behind = (1.0 - FRONT_SHARE) / np.maximum(count, 1) if near.blank else 1.0 - EVEN_SHARE
    chance = np.where(surface, np.log(1.0 - near.own_chance), 0.0).min(axis=1)
    log_any = planes.log_any[subset_of(surface)]
    weight = chance + log_any + np.log(np.where(in_front, front, behind))
    return np.asarray(np.where(count > 0, weight, 0.0), dtype=np.float64)


def _nothing_log_weight(near: NearSamples, planes: PlaneHypotheses) -> float:
    """Return the log weight of the division without own samples: the target lies behind all of them."""
    every = np.ones((1, len(near.q)), dtype=np.bool_)
    surfaces = _surfaces(near, every)
    if len(surfaces) == 1 and near.own_chance.max() <= EVEN_SHARE:
        own_chance = math.exp(float(_own_log_chance(near, every)[0]))
        evidence = float(planes.log_any[subset_of(every)][0])
        front = FRONT_SHARE if near.blank else EVEN_SHARE
        return evidence + math.log(ALONE_NOTHING_CHANCE * (1.0 - own_chance) * front)
    in_front = np.ones(1, dtype=np.bool_)
    weights = [float(_other_log_weight(near, planes, each, in_front=in_front)[0]) for each in surfaces]
    return math.log(NOTHING_CHANCE) + sum(weights)


def _middle(values: NDArray[np.float64], kept: Mask) -> NDArray[np.float64]:
    """Return (s, m) the median of (s, m, n) values over the kept, (m, n); infinite where none is kept."""
    ordered = np.sort(np.where(kept, values, np.inf), axis=2)
    count = np.maximum(kept.sum(axis=1), 1)
    rows = np.arange(len(kept))
    low, high = (ordered[:, rows, index] for index in ((count - 1) // 2, count // 2))
    return np.asarray((low + high) / 2.0)
