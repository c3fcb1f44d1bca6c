"""Search each part of a look at the disparities found there, instead of all of them everywhere.

The coarse search says which disparities each block of the left window holds. The window is halved again and
again where that makes the search cheaper; the parts overlap, so that a seam costs no matches.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.stereo.coarse import (
    BIN_PX,
    COARSE_SHRINK,
    LEAST_COARSE_SHARE,
    SPAN_MARGIN_PX,
    THOROUGH,
    CoarseMap,
    coarse_map,
    span_px,
)
from foveacam_pipeline.stereo.refine import FloatImage
from foveacam_pipeline.stereo.search import (
    FALLBACK_DISPARITIES,
    STEP,
    MatchSettings,
    matcher,
    search_window,
    window,
)
from foveacam_pipeline.stereo.values import RectifiedPair

BLOCK_CELLS = 8
"""Side of a block of the coarse search, cells."""
OVERLAP_PX = 24
"""Border that the search of a part includes around it: costs are summed along rows and columns."""
FIXED_DISPARITIES = 24
"""Cost per pixel that does not depend on the number searched, in disparities."""
LEAST_SAVING = 0.05
"""Least share of the cost of the whole window that a division must save."""
LEAST_DISPARITIES = 48
"""Least number searched in a part: with fewer, hardly any contradicts a mismatch."""
UNMATCHED = -(2**15)

Grays = tuple[NDArray[np.uint8], NDArray[np.uint8]]
"""The windows of both eyes, each (h, w)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchTile:
    """A part of the left window, px from and up to (exclusive), and the `count` disparities from `first`."""

    top: int
    bottom: int
    left: int
    right: int
    first: int
    count: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SearchPlan:
    """The parts to search, and the coarse search that chose them (None if the range was set or not found)."""

    tiles: list[SearchTile]
    coarse: CoarseMap | None


@dataclass(frozen=True, slots=True, kw_only=True)
class _Blocks:
    """The least and the largest disparity about each block (n, m), px; infinite, reversed, where unknown."""

    low: FloatImage
    high: FloatImage

    def part(self, rows: slice, columns: slice) -> "_Blocks":
        return _Blocks(low=self.low[rows, columns], high=self.high[rows, columns])

    def transposed(self) -> "_Blocks":
        return _Blocks(low=self.low.T, high=self.high.T)


def plan_search(pair: RectifiedPair, grays: Grays, settings: MatchSettings) -> SearchPlan:
    """Return the parts of the left window and the disparities to search in each."""
    height, width = grays[0].shape
    coarse = coarse_map(pair, grays, settings) if settings.scene_decides else None
    found = None if coarse is None else coarse.sure_px[np.isfinite(coarse.sure_px)]
    if coarse is None or found is None or len(found) < LEAST_COARSE_SHARE * coarse.sure_px.size:
        first, count = search_window(pair, settings)
        whole = SearchTile(top=0, bottom=height, left=0, right=width, first=first, count=count)
        return SearchPlan(tiles=[whole], coarse=None)
    blocks = _blocks(coarse.sure_px, found)
    side = BLOCK_CELLS * COARSE_SHRINK
    tiles = []
    for rows, columns in _divided(blocks, (slice(0, blocks.low.shape[0]), slice(0, blocks.low.shape[1]))):
        first, count = _part_window(blocks.part(rows, columns), pair, settings)
        tile = SearchTile(
            top=rows.start * side,
            bottom=height if rows.stop == blocks.low.shape[0] else rows.stop * side,
            left=columns.start * side,
            right=width if columns.stop == blocks.low.shape[1] else columns.stop * side,
            first=first,
            count=count,
        )
        tiles.append(tile)
    return SearchPlan(tiles=tiles, coarse=coarse)


def _part_window(part: _Blocks, pair: RectifiedPair, settings: MatchSettings) -> tuple[int, int]:
    """Return the first disparity to search in a part and their number."""
    low, high = float(part.low.min()) - SPAN_MARGIN_PX, float(part.high.max()) + SPAN_MARGIN_PX
    if high < low:
        return search_window(pair, settings)
    spare = max(0.0, LEAST_DISPARITIES - 2 - (high - low)) / 2
    low = max(low - spare, -pair.offset_px)
    return window((low, max(high + spare, low + 1.0)))


def match_tiles(grays: Grays, tiles: list[SearchTile], settings: MatchSettings) -> FloatImage:
    """Return (h, w) disparities of two grey windows, px, NaN where OpenCV's matcher rejects them."""
    before = max(0, *(tile.first + tile.count - 1 for tile in tiles))
    after = max(0, *(-tile.first for tile in tiles))
    padded = [cv2.copyMakeBorder(image, 0, 0, before, after, cv2.BORDER_REPLICATE) for image in grays]
    height, width = grays[0].shape
    raw = np.full((height, width), UNMATCHED, dtype=np.int16)
    for tile in tiles:
        top, bottom = max(0, tile.top - OVERLAP_PX), min(height, tile.bottom + OVERLAP_PX)
        left, right = max(0, tile.left - OVERLAP_PX), min(width, tile.right + OVERLAP_PX)
        margin = max(0, tile.first + tile.count - 1)
        columns = slice(before + left - margin, before + right + max(0, -tile.first))
        opencv = matcher(first=tile.first, count=tile.count, settings=settings, speckle_px=0)
        part = np.asarray(opencv.compute(*(image[top:bottom, columns] for image in padded)), dtype=np.int16)
        part = part[tile.top - top : tile.bottom - top, margin + tile.left - left :][
            :, : tile.right - tile.left
        ]
        np.copyto(raw[tile.top : tile.bottom, tile.left : tile.right], part, where=part >= tile.first * STEP)
    cv2.filterSpeckles(raw, UNMATCHED, settings.speckle_px, 2 * STEP)
    found = raw.astype(np.float32)
    found *= np.float32(1.0 / STEP)
    found[raw == UNMATCHED] = np.nan
    return found


def _blocks(cells: FloatImage, found: NDArray[np.float32]) -> _Blocks:
    """Return the spans of the blocks and their neighbours, of disparities that are no stray mismatches."""
    kept = _held(cells, found)
    rows, columns = (math.ceil(side / BLOCK_CELLS) for side in cells.shape)
    low = np.full((rows * BLOCK_CELLS, columns * BLOCK_CELLS), np.inf, dtype=np.float32)
    high = -low
    here = slice(cells.shape[0]), slice(cells.shape[1])
    low[here], high[here] = np.where(kept, cells, np.inf), np.where(kept, cells, -np.inf)
    split = (rows, BLOCK_CELLS, columns, BLOCK_CELLS)
    neighbours = np.ones((3, 3), dtype=np.uint8)
    return _Blocks(
        low=np.asarray(cv2.erode(low.reshape(split).min(axis=(1, 3)), neighbours), dtype=np.float32),
        high=np.asarray(cv2.dilate(high.reshape(split).max(axis=(1, 3)), neighbours), dtype=np.float32),
    )


def _held(cells: FloatImage, found: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Return (n, m) which cells lie in the span of the scene and in a bin with enough matches."""
    low, high = span_px(found, THOROUGH.least_share)
    within = np.nan_to_num(cells, nan=-np.inf)
    within = np.where((within >= low) & (within < high), within, np.nan)
    bins = np.floor((within - low) / BIN_PX)
    known = np.isfinite(bins)
    counts = np.bincount(bins[known].astype(np.intp), minlength=1)
    known[known] = counts[bins[known].astype(np.intp)] >= THOROUGH.least_share * len(found)
    return known


def _divided(blocks: _Blocks, part: tuple[slice, slice]) -> Iterator[tuple[slice, slice]]:
    """Yield the rows and columns of blocks of the parts into which a part is best divided."""
    least = LEAST_SAVING * float(_cost(blocks.low.min(), blocks.high.max(), blocks.low.shape))
    rows, columns = part
    across, along = _best_cut(blocks.part(*part)), _best_cut(blocks.part(*part).transposed())
    saving, at = max(across, along)
    if saving <= least:
        yield part
    elif across >= along:
        yield from _divided(blocks, (slice(rows.start, rows.start + at), columns))
        yield from _divided(blocks, (slice(rows.start + at, rows.stop), columns))
    else:
        yield from _divided(blocks, (rows, slice(columns.start, columns.start + at)))
        yield from _divided(blocks, (rows, slice(columns.start + at, columns.stop)))


def _best_cut(part: _Blocks) -> tuple[float, int]:
    """Return the cost that the best cut between two rows saves, and the row before which it lies."""
    low, high = part.low.min(axis=1), part.high.max(axis=1)
    height, width = part.low.shape
    if height < 2:
        return -math.inf, 0
    cuts = np.arange(1, height)
    above = _cost(np.minimum.accumulate(low)[:-1], np.maximum.accumulate(high)[:-1], (cuts, width))
    below = _cost(
        np.minimum.accumulate(low[::-1])[-2::-1],
        np.maximum.accumulate(high[::-1])[-2::-1],
        (height - cuts, width),
    )
    savings = _cost(low.min(), high.max(), (height, width)) - above - below
    best = int(savings.argmax())
    return float(savings[best]), best + 1


def _cost(low: object, high: object, size: tuple[object, object]) -> NDArray[np.float64]:
    """Return the cost of searching parts of `size` blocks with spans from `low` to `high`, px."""
    span = np.asarray(high, dtype=np.float64) - np.asarray(low) + 2 * SPAN_MARGIN_PX
    count = np.maximum(STEP * np.ceil(span / STEP), LEAST_DISPARITIES)
    count = np.where(span > 0.0, count, FALLBACK_DISPARITIES)
    overlap = 2 * OVERLAP_PX / (BLOCK_CELLS * COARSE_SHRINK)
    height, width = (np.asarray(side) + overlap for side in size)
    return np.asarray(height * width * (count + FIXED_DISPARITIES), dtype=np.float64)
