"""Signed disparity for live use: semi-global matching at half size, refined by the full-size pictures.

Halving both sides and the range makes the search eight times smaller. The steps after the search work on
cells of 2 x 2 px, in strips of rows with one thread each; the map is enlarged at the end.
"""

import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.stereo.coarse import QUICK, half_window, scene_span
from foveacam_pipeline.stereo.errors import LIVE, accept_matches
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.occlusion import occluded_cells
from foveacam_pipeline.stereo.refine import FloatImage, Refinement, energy_ratios
from foveacam_pipeline.stereo.search import DEFAULT, MatchSettings, semi_global
from foveacam_pipeline.stereo.values import DisparityMap, RectifiedPair

STRIP_MARGIN = 8
"""Rows of cells that a strip reads beyond its own, as far as the cues and the steps reach."""
LEAST_STRIP = 32
"""Least number of rows of cells that a thread gets."""
LARGEST_BEND_PX = 2.0
"""Two neighbouring cells whose disparities differ by more are separated by an edge."""
LARGEST_STEP_PX = 1.5
"""Largest sub-pixel step, px of the full size; the half-size search is off by up to twice as much."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CellMatch:
    """Both grey windows (2 n, 2 m) and the half-size match (n, m), px of the full size, NaN where unknown.

    `valid_left`: (2 n, 2 m) bool; `valid_right`: (n, m), 1 where the right window shows something, else 0.
    """

    left: NDArray[np.uint8]
    right: NDArray[np.uint8]
    found_px: FloatImage
    valid_left: NDArray[np.bool_]
    valid_right: NDArray[np.uint8]

    def strip(self, begin: int, end: int) -> "CellMatch":
        """Return the rows of cells from `begin` up to `end`, exclusive."""
        cells, pixels = slice(begin, end), slice(2 * begin, 2 * end)
        return CellMatch(
            left=self.left[pixels],
            right=self.right[pixels],
            found_px=self.found_px[cells],
            valid_left=self.valid_left[pixels],
            valid_right=self.valid_right[cells],
        )


def match_cells(pair: RectifiedPair, settings: MatchSettings = DEFAULT) -> CellMatch:
    """Return the semi-global match of both windows at half the size."""
    left, right = _even(gray(pair.left)), _even(gray(pair.right))
    valid_left, valid_right = (_even(valid.view(np.uint8)) for valid in (pair.valid_left, pair.valid_right))
    whole = replace(pair, valid_left=valid_left.view(np.bool_))
    first, count = half_window(scene_span(whole, (left, right), settings, coarse=QUICK))
    half = (left.shape[1] // 2, left.shape[0] // 2)
    halves = (cv2.resize(image, half, interpolation=cv2.INTER_AREA) for image in (left, right))
    found = semi_global(
        *(np.asarray(image, dtype=np.uint8) for image in halves),
        first=first,
        count=count,
        settings=settings,
        speckle_px=settings.speckle_px // 4,
    )
    found *= np.float32(2.0)
    found[valid_left[::2, ::2] == 0] = np.nan
    return CellMatch(
        left=left,
        right=right,
        found_px=found,
        valid_left=valid_left.view(np.bool_),
        valid_right=np.ascontiguousarray(valid_right[::2, ::2]),
    )


def refine_match(match: CellMatch) -> Refinement:
    """Return the refinement of every cell by one sub-pixel step, px of the full size."""
    from foveacam_pipeline.stereo import kernels as kernels  # numba loads when depth is first computed

    bend_px, largest_px = np.float32(LARGEST_BEND_PX), np.float32(LARGEST_STEP_PX)
    result = kernels.refine_cells(match.left, match.right, match.found_px, bend_px, largest_px)
    cells = result[kernels.REFINED]
    likeness, wide_likeness = energy_ratios(result[kernels.MEAN_ENERGY], result[kernels.MEAN_OWN_ENERGY])
    return Refinement(
        residual_px=cells,
        step_px=result[kernels.STEP],
        noise=result[kernels.NOISE],
        noise_sigma_px=result[kernels.NOISE_SIGMA],
        likeness=likeness,
        wide_likeness=wide_likeness,
        seen=_seen(cells, match.valid_right),
    )


def match_live(pair: RectifiedPair, settings: MatchSettings = DEFAULT) -> DisparityMap:
    """Return the signed residual disparity of every left pixel, its error, and NaN where unknown."""
    from foveacam_pipeline.stereo.kernels import enlarge_cells  # numba loads when depth is first computed

    started = time.perf_counter()
    height, width = pair.left.shape[:2]
    match = match_cells(pair, settings)
    rows = len(match.found_px)
    residual, sigma, wrong = (np.empty(match.left.shape, dtype=np.float32) for _ in range(3))
    hidden = np.empty(match.found_px.shape, dtype=np.uint8)

    def fill(ends: tuple[int, int]) -> None:
        """Compute the rows of cells between `ends`."""
        begin, end = ends
        first = max(0, begin - STRIP_MARGIN)
        part = match.strip(first, end + STRIP_MARGIN)
        accepted = accept_matches(part.found_px, refine_match(part), model=LIVE, settings=settings)
        own, cells = slice(2 * begin, 2 * end), accepted[0]
        bends = (LARGEST_BEND_PX, np.inf, np.inf)
        for source, bend, target in zip(accepted, bends, (residual, sigma, wrong), strict=True):
            enlarge_cells(source, np.float32(bend), 2 * (begin - first), match.valid_left[own], target[own])
        hidden[begin:end] = occluded_cells(cells)[begin - first : end - first]

    count = max(1, min(cv2.getNumThreads(), rows // LEAST_STRIP))
    with ThreadPoolExecutor(count, "live-depth") as pool:
        list(pool.map(fill, pairwise(rows * part // count for part in range(count + 1))))
    occluded = cv2.resize(hidden, residual.shape[::-1], interpolation=cv2.INTER_NEAREST)
    return DisparityMap(
        residual_px=residual[:height, :width],
        sigma_px=sigma[:height, :width],
        compute_ms=(time.perf_counter() - started) * 1e3,
        occluded=np.asarray(occluded, dtype=np.uint8)[:height, :width].view(np.bool_),
        wrong=wrong[:height, :width],
    )


def _seen(cells_px: FloatImage, valid_right: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Return whether the matched cell lies in the valid part of the right window."""
    rows, columns = (np.arange(side, dtype=np.float32) for side in cells_px.shape)
    matched = columns - np.float32(0.5) * np.nan_to_num(cells_px)
    seen = cv2.remap(
        valid_right, matched, np.repeat(rows, len(columns)).reshape(matched.shape), cv2.INTER_NEAREST
    )
    return np.asarray(seen, dtype=np.bool_)


def _even(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return (h, w) uint8 with its last row or column repeated where their number is odd."""
    height, width = image.shape
    if height % 2 == 0 and width % 2 == 0:
        return image
    padded = cv2.copyMakeBorder(image, 0, height % 2, 0, width % 2, cv2.BORDER_REPLICATE)
    return np.asarray(padded, dtype=np.uint8)
