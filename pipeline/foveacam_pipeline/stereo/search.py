"""Choose the disparities to search: the limits of the caller, or else the span of the scene.

A coarse search at a quarter of the size finds the depths of the scene; the fine search covers that range
only, so that a thin range is fast and a wide one complete.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.stereo.refine import FloatImage, gradients_correlate, refine
from foveacam_pipeline.stereo.values import RectifiedPair

STEP = 16
"""OpenCV counts disparities in sixteens, and stores them in sixteenths."""
MAX_DISPARITIES = 256
MAX_SCENE_DISPARITIES = 384
"""Largest number for a range that the scene decides; a caller may set at most `MAX_DISPARITIES`."""
FALLBACK_DISPARITIES = 128
"""Number searched about the verged depth when the coarse search finds too little."""
COARSE_SHRINK = 4
COARSE_REACH_PX = 256
"""Range of the coarse search on either side of the verged depth, px."""
COARSE_SPECKLE_PX = 8
LEAST_COARSE_SHARE = 0.02
"""Least share of coarse pixels that must match for their span to be used."""
BIN_PX = 8
SPAN_MARGIN_PX = 8.0
"""Margin added to the coarse span, px: two coarse px, for objects too thin or too steep for it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MatchSettings:
    """Settings of the matcher; px at the window's scale.

    `near_m`, `far_m`: range of depths (along z) to search, limited to 256 disparities. `disparities`: number
    to search, centred on the verged depth. With none of them the scene decides. Disparities beyond infinity
    are not searched.
    """

    disparities: int | None = None
    near_m: float | None = None
    far_m: float | None = None
    block: int = 5
    uniqueness_percent: int = 10
    speckle_px: int = 150
    max_sigma_px: float = 4.0
    """A pixel with a larger error counts as unknown: there is nothing to match."""
    max_wrong: float = 0.55
    """A pixel whose error exceeds 1 px with a larger probability counts as unknown."""

    @property
    def scene_decides(self) -> bool:
        """Whether no range is set."""
        return self.near_m is None and self.far_m is None and self.disparities is None


DEFAULT = MatchSettings()


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


def search_window(pair: RectifiedPair, settings: MatchSettings = DEFAULT) -> tuple[int, int]:
    """Return the first residual disparity of the set range and their number, a multiple of 16 up to 256."""
    return window(search_span(pair, settings))


def search_span(pair: RectifiedPair, settings: MatchSettings = DEFAULT) -> tuple[float, float]:
    """Return the least and the largest residual disparity of the set range, px, at most 256 apart."""
    half = (settings.disparities or FALLBACK_DISPARITIES) / 2
    low, high = -half, half
    f_b = pair.f_px * pair.baseline_m
    if settings.near_m is not None:
        high = f_b / _positive(settings.near_m) - pair.offset_px
    if settings.far_m is not None:
        low = f_b / _positive(settings.far_m) - pair.offset_px
    low = max(low, -pair.offset_px)
    if high <= math.floor(low):
        raise InvalidInput(
            f"stereo search from {settings.near_m} m to {settings.far_m} m holds no disparity: near must be "
            f"nearer than far and than infinity (verged: {pair.verged_z_m:.2f} m); swap or widen them"
        )
    return low, min(high, math.floor(low) + MAX_DISPARITIES)


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
    cells = coarse_map(pair, grays, settings, row_px=coarse.row_px)
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


def window(between_px: tuple[float, float]) -> tuple[int, int]:
    """Return the first disparity and their number, a multiple of 16, that hold a span, px."""
    first = math.floor(between_px[0])
    return first, _rounded_count(math.ceil(between_px[1]) - first)


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
) -> FloatImage:
    """Return the disparities (n, m) of the coarse search, px at the window's scale, NaN where unknown.

    Matches whose gradients do not correlate are left out: on blank surfaces any disparity is as good.
    """
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
    count = _rounded_count(COARSE_REACH_PX // COARSE_SHRINK - first)
    found = semi_global(
        left, right, first=first, count=count, settings=settings, speckle_px=COARSE_SPECKLE_PX
    )
    refinement = refine(left, right, np.nan_to_num(found), seen_right)
    found[~(seen_left & refinement.seen & gradients_correlate(refinement))] = np.nan
    found *= np.float32(COARSE_SHRINK)
    return found


def semi_global(
    left: NDArray[np.uint8],
    right: NDArray[np.uint8],
    *,
    first: int,
    count: int,
    settings: MatchSettings,
    speckle_px: int,
) -> NDArray[np.float32]:
    """Return (h, w) disparities of two grey images, px, NaN where OpenCV's matcher rejects them."""
    width = left.shape[1]
    padded, pad_left = with_margins((left, right), first=first, count=count)
    raw = np.asarray(
        matcher(first=first, count=count, settings=settings, speckle_px=speckle_px).compute(*padded),
        dtype=np.int16,
    )[:, pad_left : pad_left + width]
    found = raw.astype(np.float32)
    found *= np.float32(1.0 / STEP)
    found[raw < first * STEP] = np.nan
    return found


def with_margins(
    images: tuple[NDArray[np.uint8], NDArray[np.uint8]], *, first: int, count: int
) -> tuple[tuple[NDArray[np.uint8], NDArray[np.uint8]], int]:
    """Return the images with repeated borders, so that their edges are searched, and the left margin, px."""
    pad_left, pad_right = max(0, first + count - 1), max(0, -first)
    left, right = (
        np.asarray(cv2.copyMakeBorder(image, 0, 0, pad_left, pad_right, cv2.BORDER_REPLICATE), dtype=np.uint8)
        for image in images
    )
    return (left, right), pad_left


def matcher(*, first: int, count: int, settings: MatchSettings, speckle_px: int) -> cv2.StereoSGBM:
    """Return OpenCV's matcher; `speckle_px`: smallest connected region that is not removed, px."""
    return cv2.StereoSGBM.create(
        minDisparity=first,
        numDisparities=count,
        blockSize=settings.block,
        P1=8 * settings.block**2,
        P2=32 * settings.block**2,
        disp12MaxDiff=1,
        preFilterCap=31,
        uniquenessRatio=settings.uniqueness_percent,
        speckleWindowSize=speckle_px,
        speckleRange=2,
        mode=cv2.StereoSGBM_MODE_SGBM_3WAY,
    )


def _rounded_count(count: int) -> int:
    return STEP * max(1, math.ceil(count / STEP))


def _positive(depth_m: float) -> float:
    if not depth_m > 0.0:
        raise InvalidInput(f"stereo search limit {depth_m} m: a depth in front of the rig (> 0 m) is needed")
    return depth_m
