"""Signed disparity of a rectified pair by semi-global matching at full size.

`search` chooses the range; OpenCV's matcher finds disparities, checks left against right and drops
speckles; `refine` measures the sub-pixel part, `errors` its sigma and the probability that it is wrong.
"""

import math
import time

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.stereo.errors import SEMI_GLOBAL, ErrorModel, MatchErrors, match_errors
from foveacam_pipeline.stereo.occlusion import occluded_pixels
from foveacam_pipeline.stereo.refine import FloatImage, Refinement, refine
from foveacam_pipeline.stereo.search import DEFAULT, MatchSettings, scene_window, semi_global
from foveacam_pipeline.stereo.values import DisparityMap, RectifiedPair

LEAST_LIKENESS = 0.1
"""Least correlation of the gradients of both windows about a pixel; below it only noise was compared. Of the
rendered fitting data, 69 % of the wrong matches on blank surfaces lie below it, 2.7 % of the right ones."""

CLEAR_LIKENESS, LEAST_LOCAL_LIKENESS = 0.25, 0.4
"""Where gradients correlate by less than the first about a pixel, they must correlate by the second at it."""


def match(pair: RectifiedPair, settings: MatchSettings = DEFAULT) -> DisparityMap:
    """Return the signed residual disparity of every left pixel, its error, and NaN where unknown."""
    started = time.perf_counter()
    found, refinement = find_and_refine(pair, settings)
    residual, sigma = accept_matches(found, refinement, model=SEMI_GLOBAL, settings=settings)
    occluded = occluded_pixels(residual)
    return DisparityMap(
        residual_px=residual,
        sigma_px=sigma,
        compute_ms=(time.perf_counter() - started) * 1e3,
        occluded=occluded,
    )


def find_and_refine(pair: RectifiedPair, settings: MatchSettings = DEFAULT) -> tuple[FloatImage, Refinement]:
    """Return the disparities (h, w) of the matcher, px, NaN where it gave none, and their refinement."""
    left, right = gray(pair.left), gray(pair.right)
    first, count = scene_window(pair, (left, right), settings)
    found = semi_global(
        left, right, first=first, count=count, settings=settings, speckle_px=settings.speckle_px
    )
    found[~pair.valid_left] = np.nan
    return found, refine(left, right, np.nan_to_num(found), pair.valid_right)


def accept_matches(
    found_px: FloatImage, refinement: Refinement, *, model: ErrorModel, settings: MatchSettings
) -> tuple[FloatImage, FloatImage]:
    """Return the refined disparities and their sigmas, px, NaN where unknown or too doubtful.

    `found_px`: (h, w) disparities of a matcher, NaN where it gave none. Overwrites `refinement.residual_px`.
    """
    errors = match_errors(found_px, refinement, model)
    known = acceptable(found_px, refinement, errors, settings=settings)
    residual, sigma = refinement.residual_px, errors.sigma_px
    residual[~known] = np.nan
    sigma[~known] = np.nan
    return residual, sigma


def acceptable(
    found_px: FloatImage, refinement: Refinement, errors: MatchErrors, *, settings: MatchSettings
) -> NDArray[np.bool_]:
    """Return (h, w) bool: where a disparity was found, is seen by both eyes, and is not too doubtful."""
    known = np.isfinite(found_px) & refinement.seen & (errors.sigma_px <= settings.max_sigma_px)
    known &= gradients_correlate(refinement)
    known &= errors.wrong_log_odds <= math.log(settings.max_wrong / (1.0 - settings.max_wrong))
    return known


def gradients_correlate(refinement: Refinement) -> NDArray[np.bool_]:
    """Return (h, w) bool: where the gradients of both windows correlate more than those of noise."""
    return (refinement.wide_likeness >= np.float32(LEAST_LIKENESS)) & (
        (refinement.wide_likeness >= np.float32(CLEAR_LIKENESS))
        | (refinement.likeness >= np.float32(LEAST_LOCAL_LIKENESS))
    )


def gray(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return (h, w) uint8 luminance of a grey or RGB image."""
    if image.ndim == 2:
        return image
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), dtype=np.uint8)
