"""The depth and error stated from an inference, or nothing if that is too uncertain."""

import math

from foveacam_pipeline.verge.surroundings.infer import InferredDepth, spread_per_m

SURE_PROBABILITY = 0.8
"""Less probable inferences state the spread of all depths as their error."""
LEAST_SAMPLES = 3
"""Inferences from fewer points are doubtful too."""
DOUBT_SHARE = 0.38
"""Least error, as a share of 1/Z, of a depth known from one side alone: an edge in front looks the same."""
GAP_CHANCE = 0.08
"""Chance that a target lies behind its surroundings and is seen through a gap, where no measured point is
certain to be of its own surface. It may then be at any depth from there to the farthest measured one."""
BLANK_SHARE = 5.0e-4
"""Least share of the wide image of a blank region that is not a speck among textures, 28 wide px square.
Without a point certain to be of their own surface, 10 of 21 specks were not as deep as what surrounds them,
and 2 of 46 larger regions."""
VAGUE_SHARE = 0.6
"""Largest error of a stated distance, as a share of 1/Z; beyond it only limits are stated."""


def stated_depth(
    inferred: tuple[InferredDepth, ...], *, farthest_per_m: float, blank: bool
) -> tuple[float, float] | None:
    """Return the 1/Z and error, 1/m, to be stated for inferred depths, the most probable first.

    For a doubtful inference the error covers all of them; without a point certain to be of the target's
    surface it includes the chance of a gap. `farthest_per_m`: 1/Z of the farthest measured one about it.
    `blank`: whether the target lies in a blank region of at least `BLANK_SHARE`, not among textures. None:
    nothing is inferred, or too uncertain, or most probably something behind all that is measured.
    """
    if not inferred or inferred[0].samples == 0:
        return None
    best = inferred[0]
    sure = best.probability >= SURE_PROBABILITY and best.samples >= LEAST_SAMPLES
    sigma = best.sigma_per_m if sure else spread_per_m(inferred)
    if not best.owned:
        behind_per_m = max(0.0, best.inverse_z_per_m - farthest_per_m)
        sigma = math.hypot(sigma, math.sqrt(GAP_CHANCE / 3.0) * behind_per_m)
    sigma = error_per_m(best.inverse_z_per_m, sigma, sure=best.owned or (best.held and blank))
    return None if sigma > VAGUE_SHARE * best.inverse_z_per_m else (best.inverse_z_per_m, sigma)


def error_per_m(inverse_z_per_m: float, sigma_per_m: float, *, sure: bool) -> float:
    """Return the error of 1/Z to be stated: much larger where the depth may be that of something else."""
    return sigma_per_m if sure else max(sigma_per_m, DOUBT_SHARE * inverse_z_per_m)
