"""The depths that are listed where an answer is in doubt, each with its probability."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.verge.answer import alternative
from foveacam_pipeline.verge.distance import place_on_ray
from foveacam_pipeline.verge.single_eye.eye_match import EyeMatch
from foveacam_pipeline.verge.single_eye.search import EyeSighting
from foveacam_pipeline.verge.single_eye.weighing import same_surface
from foveacam_pipeline.verge.surroundings.infer import InferredDepth
from foveacam_pipeline.verge.values import Alternative, Basis

LISTED_CHANCE = 0.74
"""Chance that the depth of a textured target is among those inferred where neither fovea shows it: of 207 the
most probable one was right 127 times, another one 27 times."""
EYE_CHANCE = 0.8
"""Chance that a depth by one fovea is right that no surface about the target confirms: 68 of 87."""
REFUTED_CHANCE = 0.2
"""The same where looks at the surroundings suggest other depths."""


def several(
    inferred: Sequence[InferredDepth], target: NDArray[np.float64], *, chance: float = 1.0
) -> tuple[Alternative, ...]:
    """Return inferred depths in the direction of a target, (2,) tangents; none if there is only one.

    `chance`: that one of them is right. That it lies behind all of them has a probability and no depth.
    """
    listed = _listed(inferred, target, chance=chance)
    return listed if len(listed) > 1 else ()


def doubted(
    depth: tuple[float, float], near: Sequence[InferredDepth], target: NDArray[np.float64]
) -> tuple[Alternative, ...]:
    """Return the depth by one eye and those of surfaces about the target; none where they agree.

    `depth`: 1/Z and its standard error.
    """
    others = [one for one in near if not same_surface(*depth, one)]
    if not others:
        return ()
    return (_by_eye(depth, target, EYE_CHANCE), *_listed(others, target, chance=1.0 - EYE_CHANCE))


def refuted_eye(
    match: EyeMatch, inferred: Sequence[InferredDepth], target: NDArray[np.float64], *, chance: float
) -> tuple[Alternative, ...]:
    """Return the depths about a target, and the one by an eye that they refute."""
    depth = match.inverse_z_per_m, match.sigma_per_m
    about = _listed(inferred, target, chance=min(chance, 1.0 - REFUTED_CHANCE))
    return (*about, _by_eye(depth, target, REFUTED_CHANCE))


def rivals(sighted: Sequence[EyeSighting], target: NDArray[np.float64]) -> tuple[Alternative, ...]:
    """Return the depths of two foveae that disagree, weighted by 1 / (1 - correlation)."""
    doubts = [1.0 / max(1.0 - one.match.score, 1e-3) for one in sighted]
    ranked = sorted(zip(sighted, doubts, strict=True), key=lambda pair: -pair[1])
    return tuple(
        _by_eye((one.match.inverse_z_per_m, one.match.sigma_per_m), target, weight / sum(doubts))
        for one, weight in ranked
    )


def _by_eye(depth: tuple[float, float], target: NDArray[np.float64], probability: float) -> Alternative:
    return alternative(Basis.FOVEA_AND_WIDE, place_on_ray(target, *depth), probability)


def _listed(
    inferred: Sequence[InferredDepth], target: NDArray[np.float64], *, chance: float
) -> tuple[Alternative, ...]:
    total = sum(one.probability for one in inferred) / chance
    return tuple(
        alternative(
            Basis.SURROUNDINGS,
            place_on_ray(target, one.inverse_z_per_m, one.sigma_per_m),
            one.probability / total,
        )
        for one in inferred
        if one.samples > 0
    )
