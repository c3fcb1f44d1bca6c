"""Planes of 1/Z through every subset of a few samples, all at once: Bayesian linear regression.

A plane is linear in 1/Z over the tangents. The priors of its level and slopes are normal about a common
level; the slope has a mixture of priors, for surfaces that roughly face the rig and for the others.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

LEVEL_SIGMA_PER_M = 0.3
"""Prior standard deviation of 1/Z about the common level."""
SLOPE_SIGMAS = (0.15, 1.0)
"""Prior standard deviations of the slope of 1/Z, relative to 1/Z and per unit of tangent, each for half of
all surfaces: those that roughly face the rig, and the others, of which those at 45 degrees are common."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlaneHypotheses:
    """Planes through each of the 2**n subsets of n samples, under each of s priors of the slope.

    `log_evidence`: (s, 2**n) log marginal likelihood of the subset, the prior's share included. `plane`: (s,
    2**n, 3) level above the common one and slopes. `variance`: (s, 2**n) of 1/Z at the target.
    """

    log_evidence: NDArray[np.float64]
    plane: NDArray[np.float64]
    variance: NDArray[np.float64]
    log_any: NDArray[np.float64]
    """(2**n,) log marginal likelihood, marginalised over the slope's priors."""


def subset_of(member: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return the indices, (...), of subsets, given (..., n) membership of their samples."""
    return np.asarray(member @ (1 << np.arange(member.shape[-1])), dtype=np.int64)


def planes_through(
    offsets: NDArray[np.float64], q: NDArray[np.float64], sigma: NDArray[np.float64], *, level: float
) -> PlaneHypotheses:
    """Return the planes through all subsets of samples.

    `offsets`: (n, 2) from the target, tangents. `q`, `sigma`: (n,) 1/Z and its error. `level`: common 1/Z.
    """
    count = len(q)
    member = (np.arange(2**count)[:, None] >> np.arange(count)) & 1
    design = np.column_stack([np.ones(count), offsets])
    residual = q - level
    weights = member / sigma**2
    normal = np.einsum("mi,ia,ib->mab", weights, design, design)
    side = (weights * residual) @ design
    squares = weights @ residual**2
    log_noise = member @ np.log(2.0 * math.pi * sigma**2)
    evidence, plane, variance = [], [], []
    for slope_sigma in SLOPE_SIGMAS:
        slope = (slope_sigma * level) ** 2
        prior = np.array([LEVEL_SIGMA_PER_M**2, slope, slope])
        posterior = normal + np.diag(1.0 / prior)
        solved = np.linalg.solve(posterior, side[..., None])[..., 0]
        log_det = np.linalg.slogdet(posterior)[1] + np.log(prior).sum()
        fit = squares - np.sum(side * solved, axis=1)
        evidence.append(-0.5 * (fit + log_det + log_noise) - math.log(len(SLOPE_SIGMAS)))
        plane.append(solved)
        variance.append(np.linalg.inv(posterior)[:, 0, 0])
    log_evidence = np.array(evidence)
    return PlaneHypotheses(
        log_evidence=log_evidence,
        plane=np.array(plane),
        variance=np.array(variance),
        log_any=np.logaddexp.reduce(log_evidence, axis=0),
    )
