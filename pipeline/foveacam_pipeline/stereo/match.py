"""Signed disparity of a rectified pair by semi-global matching at full size.

`search` chooses the range; OpenCV's matcher finds disparities, checks left against right and drops
speckles; `refine` measures the sub-pixel part, `errors` its sigma and the probability that it is wrong.
"""

import time
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.stereo.coarse import contradicted
from foveacam_pipeline.stereo.errors import SEMI_GLOBAL, accept_matches
from foveacam_pipeline.stereo.occlusion import occluded_pixels
from foveacam_pipeline.stereo.refine import FloatImage, Refinement, refine
from foveacam_pipeline.stereo.search import DEFAULT, MatchSettings
from foveacam_pipeline.stereo.tiles import SearchPlan, match_tiles, plan_search
from foveacam_pipeline.stereo.values import DisparityMap, RectifiedPair

MAX_WRONG_IN_SCENE = 0.37
"""Largest probability of an error above 1 px where the scene decides what is searched: `max_wrong` belongs to
wide ranges, in which other disparities contradict more of the mismatches."""


def match(pair: RectifiedPair, settings: MatchSettings = DEFAULT) -> DisparityMap:
    """Return the signed residual disparity of every left pixel, its error, and NaN where unknown."""
    started = time.perf_counter()
    found, refinement = find_and_refine(pair, settings)
    settings = acceptance(settings)
    residual, sigma, wrong = accept_matches(found, refinement, model=SEMI_GLOBAL, settings=settings)
    occluded = occluded_pixels(residual)
    return DisparityMap(
        residual_px=residual,
        sigma_px=sigma,
        compute_ms=(time.perf_counter() - started) * 1e3,
        occluded=occluded,
        wrong=wrong,
    )


def acceptance(settings: MatchSettings) -> MatchSettings:
    """Return the settings with the limits by which matches are accepted."""
    if not settings.scene_decides:
        return settings
    return replace(settings, max_wrong=min(settings.max_wrong, MAX_WRONG_IN_SCENE))


def find_and_refine(pair: RectifiedPair, settings: MatchSettings = DEFAULT) -> tuple[FloatImage, Refinement]:
    """Return the disparities (h, w) of the matcher, px, NaN where it gave none, and their refinement."""
    grays = gray(pair.left), gray(pair.right)
    plan = plan_search(pair, grays, settings)
    found = match_tiles(grays, plan.tiles, settings)
    leave_out(found, pair, plan)
    return found, refine(*grays, np.nan_to_num(found), pair.valid_right)


def leave_out(found_px: FloatImage, pair: RectifiedPair, plan: SearchPlan) -> None:
    """Set disparities (h, w) to NaN outside the left frame and where the coarse search contradicts them."""
    found_px[~pair.valid_left] = np.nan
    if plan.coarse is not None:
        found_px[contradicted(plan.coarse, found_px)] = np.nan


def gray(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return (h, w) uint8 luminance of a grey or RGB image."""
    if image.ndim == 2:
        return image
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), dtype=np.uint8)
