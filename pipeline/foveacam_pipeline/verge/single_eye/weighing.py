"""How measurements of one target are weighed against each other; pure functions."""

import math

import numpy as np

from foveacam_pipeline.verge.single_eye.eye_match import EyeMatch
from foveacam_pipeline.verge.surroundings.infer import MAX_SAMPLES, InferredDepth

AGREE_SIGMAS = 4.0
SURE_SCORE = 0.7
"""Least weighted correlation of a registration."""
LEAD, LEAD_RATIO = 0.1, 4.0
"""What fits at another depth must fall short by so much, or lack so many times more of a perfect fit."""
APART_SIGMAS = 5.0
"""Registrations whose depths differ by less are one."""
PLAUSIBLE_PROBABILITY = 0.35
PLAUSIBLE_SIGMAS, PLAUSIBLE_SHARE = 5.0, 0.015
"""What one eye shows must be as deep as a surface found next to it, within errors and this share of 1/Z."""


def agree(one: EyeMatch, other: EyeMatch) -> bool:
    """Return whether two eyes find a target at the same depth."""
    apart = abs(one.inverse_z_per_m - other.inverse_z_per_m)
    return apart <= AGREE_SIGMAS * math.hypot(one.sigma_per_m, other.sigma_per_m)


def sound(match: EyeMatch) -> bool:
    """Return whether a registration fits well and has an error."""
    return match.score >= SURE_SCORE and math.isfinite(match.sigma_per_m)


def only_sure(places: list[EyeMatch]) -> EyeMatch | None:
    """Return the best sound registration when nothing at another depth fits nearly as well."""
    if not places:
        return None
    best = max(places, key=lambda match: match.score)
    if not sound(best):
        return None
    for other in places:
        apart = abs(other.inverse_z_per_m - best.inverse_z_per_m)
        rivals = other.score > best.score - LEAD and 1.0 - other.score < LEAD_RATIO * (1.0 - best.score)
        if apart > APART_SIGMAS * best.sigma_per_m and rivals:
            return None
    return best


def outdone(match: EyeMatch, others: list[EyeMatch]) -> bool:
    """Return whether the other eye shows the target far better, at several depths but not at this one."""
    better = [one for one in others if LEAD_RATIO * (1.0 - one.score) < 1.0 - match.score and sound(one)]
    return bool(better) and not any(agree(one, match) for one in better)


def weighted(matches: list[EyeMatch]) -> tuple[float, float]:
    """Return the mean 1/Z of matches weighted by their errors, and its error."""
    weights = np.array([match.sigma_per_m**-2 for match in matches])
    values = np.array([match.inverse_z_per_m for match in matches])
    return float(weights @ values / weights.sum()), float(weights.sum() ** -0.5)


def plausible(match: EyeMatch, near: tuple[InferredDepth, ...]) -> bool:
    """Return whether what one eye shows is as deep as something found next to the target, if anything is."""
    return not near or any(
        abs(match.inverse_z_per_m - other.inverse_z_per_m) <= _slack(match.sigma_per_m, other)
        for other in near
        if other.probability >= PLAUSIBLE_PROBABILITY
    )


def confirmed(inverse_z_per_m: float, sigma_per_m: float, near: tuple[InferredDepth, ...]) -> bool:
    """Return whether a surface at the target, or all that was measured about it, is as deep as an eye shows.

    Of 197 depths that were confirmed so none was wrong; of 98 others 22 were.
    """
    return any(
        (other.owned or (other.held and other.samples >= MAX_SAMPLES))
        and abs(inverse_z_per_m - other.inverse_z_per_m) <= _slack(sigma_per_m, other)
        for other in near
    )


def slack_per_m(inferred: InferredDepth) -> float:
    """Return by how much a match may differ from an inference that it confirms."""
    return max(PLAUSIBLE_SIGMAS * inferred.sigma_per_m, PLAUSIBLE_SHARE * inferred.inverse_z_per_m)


def _slack(sigma_per_m: float, other: InferredDepth) -> float:
    return max(slack_per_m(other), PLAUSIBLE_SIGMAS * sigma_per_m)
