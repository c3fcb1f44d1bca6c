"""Signed disparity for live use: semi-global matching at half the size, refined at full size.

Halving both sides and the range makes the search eight times smaller. Two sub-pixel steps at full size then
make up for the coarser grid.
"""

import time

import cv2
import numpy as np

from foveacam_pipeline.stereo.error_models import LIVE
from foveacam_pipeline.stereo.match import gray, judged
from foveacam_pipeline.stereo.refine import FloatImage, Refinement, refine
from foveacam_pipeline.stereo.search import DEFAULT, MatchSettings, scene_window, semi_global
from foveacam_pipeline.stereo.values import DisparityMap, RectifiedPair

LARGEST_BEND_PX = 1.0
"""Where the interpolated and the nearest disparity differ by more, an edge lies between."""

LARGEST_FIRST_STEP_PX = 1.5
"""A px of the half size is two: so much may be missing at first."""


def match_live(pair: RectifiedPair, settings: MatchSettings = DEFAULT) -> DisparityMap:
    """Return the signed residual disparity of every left pixel, its error, and NaN where unknown."""
    started = time.perf_counter()
    found, refinement = refined_half_match(pair, settings)
    return judged(found, refinement, model=LIVE, settings=settings, started_s=started)


def refined_half_match(
    pair: RectifiedPair, settings: MatchSettings = DEFAULT
) -> tuple[FloatImage, Refinement]:
    """Return the disparities of the half-size match at full size, (h, w) px, and their refinement."""
    left, right = gray(pair.left), gray(pair.right)
    first, count = scene_window(pair, (left, right), settings)
    height, width = left.shape
    size = ((width + 1) // 2, (height + 1) // 2)
    small_left, small_right = (
        np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
        for image in (left, right)
    )
    low, high = first // 2, -((first + count) // -2)
    found = semi_global(
        small_left,
        small_right,
        first=low,
        count=-((high - low) // -16) * 16,
        settings=settings,
        speckle_px=settings.speckle_px // 4,
    )
    enlarged = _enlarged(found, (width, height))
    enlarged[~pair.valid_left] = np.nan
    refinement = refine(
        left, right, np.nan_to_num(enlarged), pair.valid_right, largest_step_px=LARGEST_FIRST_STEP_PX
    )
    refinement = refine(left, right, refinement.residual_px, pair.valid_right)
    return enlarged, refinement


def _enlarged(found_px: FloatImage, size: tuple[int, int]) -> FloatImage:
    """Return a disparity map at `size` (width, height), px there; smooth between pixels of one surface."""
    scale = np.float32(size[0] / found_px.shape[1])
    nearest = np.asarray(cv2.resize(found_px, size, interpolation=cv2.INTER_NEAREST), dtype=np.float32)
    smooth = np.asarray(cv2.resize(found_px, size, interpolation=cv2.INTER_LINEAR), dtype=np.float32)
    bends = np.abs(smooth - nearest) > np.float32(LARGEST_BEND_PX / 2)
    smooth[bends | np.isnan(smooth)] = nearest[bends | np.isnan(smooth)]
    smooth *= scale
    return smooth
