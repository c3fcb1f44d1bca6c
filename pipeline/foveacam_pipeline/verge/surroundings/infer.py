"""The depth of a point without texture, inferred from measured points around it.

A plane is linear in inverse depth over the tangents. Every sample is of the target's surface or of another
one, mostly in front of it; each division of the samples is a hypothesis with a weight (`divisions.py`), and
hypotheses that agree are merged. One more hypothesis has all samples in front.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.verge.surroundings.depth_samples import DepthSamples
from foveacam_pipeline.verge.surroundings.divisions import Divisions, NearSamples, enclose, weigh_divisions

MAX_SAMPLES = 8
"""Number of nearest samples that are used: 2 to the power of it divisions are weighed."""
UNEVEN_SIGMA = 2.0e-3
"""Standard deviation of real surfaces from planes, relative to 1/Z."""
OWN_CHANCE = 0.55
"""Prior chance that a sample is of the target's surface."""
LEAST_PROBABILITY = 0.08
"""Less probable hypotheses are left out."""


@dataclass(frozen=True, slots=True, kw_only=True)
class InferredDepth:
    """One depth that the surroundings suggest: 1/Z, its standard error, and the hypothesis' probability.

    `samples`: number of measured points on the target's surface. `owned`: whether one of them is next to the
    target or certain to be of its surface. `held`: whether one is, or they surround the target, if need be
    together with nearer points.
    """

    inverse_z_per_m: float
    sigma_per_m: float
    probability: float
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
    """Return the inferred depths in a direction, (2,) tangents, the most probable first.

    `own_chance`: (n,) chance of each sample to be of the target's surface, `OWN_CHANCE` by default. `blank`:
    whether the target is within a blank region, on whose border the samples lie.
    """
    if len(samples) == 0:
        return ()
    chance = np.full(len(samples), OWN_CHANCE) if own_chance is None else own_chance
    offsets = samples.tangents - target
    nearest = np.argsort(np.hypot(*offsets.T))[:MAX_SAMPLES]
    offsets, q = offsets[nearest], samples.inverse_z_per_m[nearest]
    level = float(np.median(q))
    sigma = np.hypot(samples.sigma_per_m[nearest], UNEVEN_SIGMA * level)
    near = NearSamples(
        offsets=offsets, q=q, sigma=sigma, own_chance=chance[nearest], level=level, blank=blank
    )
    return _merged(weigh_divisions(near))


class LastInference:
    """Caches the last inference, which remains valid when a look adds no sample, as most do."""

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
        """Return `infer_depth` of the samples, from the cache when they are the same."""
        offsets = samples.tangents - target
        table = np.column_stack([offsets, samples.inverse_z_per_m, samples.sigma_per_m, own_chance])
        if self._given is None or self._given[1] != blank or not np.array_equal(self._given[0], table):
            self._inferred = infer_depth(samples, target, own_chance=own_chance, blank=blank)
            self._given = table, blank
        return self._inferred


def encloses(offsets: NDArray[np.float64]) -> bool:
    """Return whether points at (n, 2) offsets surround a target without a gap of half a turn."""
    return bool(enclose(offsets, np.ones((1, len(offsets)), dtype=np.bool_))[0])


def spread_per_m(inferred: tuple[InferredDepth, ...]) -> float:
    """Return the RMS difference of all depths from the most probable, errors included."""
    best, total = inferred[0].inverse_z_per_m, sum(one.probability for one in inferred)
    variance = sum(
        one.probability / total * (one.sigma_per_m**2 + (one.inverse_z_per_m - best) ** 2) for one in inferred
    )
    return math.sqrt(variance)


def _merged(divisions: Divisions) -> tuple[InferredDepth, ...]:
    """Merge hypotheses that agree within their errors; return the probable ones, best first.

    That the target lies behind all samples agrees with none: it is a range of depths.
    """
    order = np.argsort(-divisions.log_weight, kind="stable")
    weights = np.exp(divisions.log_weight[order] - divisions.log_weight[order[0]])
    values, variances = divisions.inverse_z_per_m[order], divisions.variance[order]
    measured = divisions.samples[order] > 0
    total = float(weights.sum())
    left = np.ones(len(order), dtype=np.bool_)
    found: list[InferredDepth] = []
    while left.any():
        head = int(np.argmax(left))
        reach = 2.0 * np.sqrt(variances[head] + np.minimum(variances, variances[head]))
        group = left & (np.abs(values - values[head]) <= reach)
        group &= measured == measured[head]
        left &= ~group
        probability = float(weights[group].sum()) / total
        if probability < LEAST_PROBABILITY:
            continue
        shares = weights[group] / weights[group].sum()
        mean = float(shares @ values[group])
        variance = float(shares @ (variances[group] + (values[group] - mean) ** 2))
        found.append(
            InferredDepth(
                inverse_z_per_m=mean,
                sigma_per_m=math.sqrt(variance),
                probability=probability,
                samples=int(divisions.samples[order[head]]),
                owned=bool(divisions.owned[order[head]]),
                held=bool(divisions.held[order[head]]),
            )
        )
    return tuple(sorted((f for f in found if f.inverse_z_per_m > 0.0), key=lambda f: -f.probability))
