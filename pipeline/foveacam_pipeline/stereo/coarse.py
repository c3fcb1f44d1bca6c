"""Find the depths of a scene by a search at a quarter of the size.

The fine search then covers those only, so that a thin range is fast and a wide one complete.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.stereo.errors import SEMI_GLOBAL, acceptable, match_errors
from foveacam_pipeline.stereo.refine import FloatImage, refine
from foveacam_pipeline.stereo.search import (
    DEFAULT,
    MatchSettings,
    rounded_count,
    search_span,
    semi_global,
    window,
)
from foveacam_pipeline.stereo.values import RectifiedPair

MAX_SCENE_DISPARITIES = 384
"""Largest number for a range that the scene decides; a caller may set at most `MAX_DISPARITIES`."""
COARSE_SHRINK = 4
COARSE_REACH_PX = 256
"""Range of the coarse search on either side of the verged depth, px."""
COARSE_SPECKLE_PX = 8
LEAST_COARSE_SHARE = 0.02
"""Least share of coarse pixels that must match for their span to be used."""
BIN_PX = 8
SPAN_MARGIN_PX = 8.0
"""Margin added to the coarse span, px: two coarse px, for objects too thin or too steep for it."""


KNOWN_CELLS, LEAST_KNOWN_SHARE = 9, 0.3
"""Least share of the coarse cells in this window that must match; elsewhere there is nothing to match."""
AGREEING_CELLS = 9
"""A fine match must lie near the disparities of the coarse cells in this window."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CoarseMap:
    """Disparities (n, m) of the coarse search, px at the window's scale, NaN where unknown.

    `found_px`: all matches. `sure_px`: without doubtful ones: on a blank surface any disparity matches.
    """

    found_px: FloatImage
    sure_px: FloatImage


@dataclass(frozen=True, slots=True, kw_only=True)
class CoarseSearch:
    """Settings of the coarse search for the span of the scene."""

    row_px: int
    """Height of the rows compared, px at the window's scale; their pixels are `COARSE_SHRINK` wide."""
    least_share: float
    """Least share of the coarse matches in a bin of `BIN_PX`; bins with less are mismatches."""


THOROUGH = CoarseSearch(row_px=COARSE_SHRINK, least_share=0.004)
QUICK = CoarseSearch(row_px=2 * COARSE_SHRINK, least_share=0.012)
"""Half the time of `THOROUGH`, spans 3/4 as wide; misses 0.7 % more of the pixels of 52 looks."""


def scene_window(
    pair: RectifiedPair, grays: tuple[NDArray[np.uint8], NDArray[np.uint8]], settings: MatchSettings = DEFAULT
) -> tuple[int, int]:
    """Return the first residual disparity to search and their number; `grays`: (h, w) of both windows."""
    return window(scene_span(pair, grays, settings))


def scene_span(
    pair: RectifiedPair,
    grays: tuple[NDArray[np.uint8], NDArray[np.uint8]],
    settings: MatchSettings = DEFAULT,
    *,
    coarse: CoarseSearch = THOROUGH,
) -> tuple[float, float]:
    """Return the least and the largest residual disparity to search, px; `grays`: (h, w) of both windows."""
    if not settings.scene_decides:
        return search_span(pair, settings)
    cells = coarse_map(pair, grays, settings, row_px=coarse.row_px).sure_px
    found = cells[np.isfinite(cells)]
    if len(found) < LEAST_COARSE_SHARE * cells.size:
        return search_span(pair, settings)
    low, high = span_px(found, coarse.least_share)
    low = max(low - SPAN_MARGIN_PX, -pair.offset_px)
    return low, min(high + SPAN_MARGIN_PX, math.floor(low) + MAX_SCENE_DISPARITIES)


def half_window(span_px: tuple[float, float]) -> tuple[int, int]:
    """Return the first disparity at half the size and their number, for a span at full size."""
    low_px, high_px = span_px
    return window((low_px / 2.0, high_px / 2.0))


def span_px(found_px: NDArray[np.float32], least_share: float) -> tuple[float, float]:
    """Return the least and the largest disparity, px, of bins with `least_share` of the coarse matches (n,).

    Of a span that is too wide to search, return the part with the most matches.
    """
    bins = np.floor(found_px / BIN_PX).astype(np.intp)
    lowest = int(bins.min())
    counts = np.bincount(bins - lowest)
    counts[counts < least_share * len(bins)] = 0
    held = MAX_SCENE_DISPARITIES // BIN_PX - 2
    sums = np.convolve(counts, np.ones(min(held, len(counts)), dtype=np.intp), mode="valid")
    start = int(sums.argmax())
    kept = start + np.flatnonzero(counts[start : start + held])
    return float((lowest + kept[0]) * BIN_PX), float((lowest + kept[-1] + 1) * BIN_PX)


def coarse_map(
    pair: RectifiedPair,
    grays: tuple[NDArray[np.uint8], NDArray[np.uint8]],
    settings: MatchSettings = DEFAULT,
    *,
    row_px: int = COARSE_SHRINK,
) -> CoarseMap:
    """Search a quarter of the columns, and a row in `row_px`, for disparities of `COARSE_REACH_PX`."""
    height, width = grays[0].shape
    size = (max(1, width // COARSE_SHRINK), max(1, height // row_px))
    whole_cells = (slice(size[1] * row_px), slice(size[0] * COARSE_SHRINK))  # several times faster to shrink
    left, right = (
        np.asarray(cv2.resize(image[whole_cells], size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
        for image in grays
    )
    seen_left, seen_right = (
        cv2.resize(valid[whole_cells].view(np.uint8), size, interpolation=cv2.INTER_NEAREST).astype(np.bool_)
        for valid in (pair.valid_left, pair.valid_right)
    )
    first = math.floor(max(-COARSE_REACH_PX, -pair.offset_px) / COARSE_SHRINK)
    count = rounded_count(COARSE_REACH_PX // COARSE_SHRINK - first)
    found = semi_global(
        left, right, first=first, count=count, settings=settings, speckle_px=COARSE_SPECKLE_PX
    )
    found[~seen_left | (found < first + 1) | (found > first + count - 2)] = np.nan  # ends attract mismatches
    refinement = refine(left, right, np.nan_to_num(found), seen_right)
    errors = match_errors(found, refinement, SEMI_GLOBAL)
    found *= np.float32(COARSE_SHRINK)
    sure = acceptable(found, refinement, errors, settings=settings)
    return CoarseMap(found_px=found, sure_px=np.where(sure, found, np.float32(np.nan)))


def contradicted(coarse: CoarseMap, disparity_px: FloatImage) -> NDArray[np.bool_]:
    """Return (h, w) bool: where the coarse search found little, or nothing near a disparity (h, w), px.

    It searches farther than the fine one, so that it contradicts mismatches which the fine one accepts.
    """
    known = np.isfinite(coarse.found_px)
    share = cv2.blur(known.astype(np.float32), (KNOWN_CELLS, KNOWN_CELLS))
    near = np.ones((AGREEING_CELLS, AGREEING_CELLS), dtype=np.uint8)
    low = cv2.erode(np.where(known, coarse.found_px, np.float32(1e6)), near)
    high = cv2.dilate(np.where(known, coarse.found_px, np.float32(-1e6)), near)
    low[share < np.float32(LEAST_KNOWN_SHARE)] = np.float32(1e6)
    size = disparity_px.shape[::-1]
    low, high = (cv2.resize(limit, size, interpolation=cv2.INTER_NEAREST) for limit in (low, high))
    margin = np.float32(SPAN_MARGIN_PX)
    return np.asarray((disparity_px < low - margin) | (disparity_px > high + margin), dtype=np.bool_)
