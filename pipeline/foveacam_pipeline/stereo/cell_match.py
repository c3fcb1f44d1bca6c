"""The half-size match of the live backend, and its refinement by full-size pictures in cells of 2 x 2 px."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.refine import FloatImage, Refinement, energy_ratios
from foveacam_pipeline.stereo.search import (
    DEFAULT,
    QUICK,
    MatchSettings,
    half_window,
    scene_span,
    semi_global,
)
from foveacam_pipeline.stereo.values import RectifiedPair

LARGEST_BEND_PX = 2.0
"""Where the disparities of two neighbouring cells differ by more, an edge lies between."""
LARGEST_STEP_PX = 1.5
"""A px of the half size is two: so much more may be missing than at full size."""


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
        """Return the rows of cells from `begin` to before `end`."""
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
    from foveacam_pipeline.stereo import cell_kernels as kernels  # numba loads when depth is asked for

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


def _seen(cells_px: FloatImage, valid_right: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Return whether the matched cell lies in the valid part of the right window."""
    rows, columns = (np.arange(side, dtype=np.float32) for side in cells_px.shape)
    places = columns - np.float32(0.5) * np.nan_to_num(cells_px)
    seen = cv2.remap(
        valid_right, places, np.repeat(rows, len(columns)).reshape(places.shape), cv2.INTER_NEAREST
    )
    return np.asarray(seen, dtype=np.bool_)


def _even(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return (h, w) uint8 with its last row or column repeated where their number is odd."""
    height, width = image.shape
    if height % 2 == 0 and width % 2 == 0:
        return image
    padded = cv2.copyMakeBorder(image, 0, height % 2, 0, width % 2, cv2.BORDER_REPLICATE)
    return np.asarray(padded, dtype=np.uint8)
