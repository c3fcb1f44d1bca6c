"""Signed disparity for live use: semi-global matching at half the size, refined by the full-size pictures.

Halving both sides and the range makes the search eight times smaller. All that follows the search is worked
out for cells of 2 x 2 px, in strips of rows, a thread each; the map is enlarged at the end.
"""

import time
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import cv2
import numpy as np

from foveacam_pipeline.stereo.cell_match import LARGEST_BEND_PX, match_cells, refine_match
from foveacam_pipeline.stereo.error_models import LIVE
from foveacam_pipeline.stereo.match import believed
from foveacam_pipeline.stereo.occlusion import occluded_cells
from foveacam_pipeline.stereo.search import DEFAULT, MatchSettings
from foveacam_pipeline.stereo.values import DisparityMap, RectifiedPair

STRIP_MARGIN = 8
"""Rows of cells that a strip looks at beyond its own: the cues and the steps reach no farther."""
LEAST_STRIP = 32
"""Rows of cells below which a strip is not worth a thread."""


def match_live(pair: RectifiedPair, settings: MatchSettings = DEFAULT) -> DisparityMap:
    """Return the signed residual disparity of every left pixel, its error, and NaN where unknown."""
    from foveacam_pipeline.stereo.cell_kernels import enlarge_cells  # numba loads when depth is asked for

    started = time.perf_counter()
    height, width = pair.left.shape[:2]
    match = match_cells(pair, settings)
    rows = len(match.found_px)
    residual, sigma = (
        np.empty(match.left.shape, dtype=np.float32),
        np.empty(match.left.shape, dtype=np.float32),
    )
    hidden = np.empty(match.found_px.shape, dtype=np.uint8)

    def fill(ends: tuple[int, int]) -> None:
        """Fill the rows of cells between `ends`, with what their surroundings tell."""
        begin, end = ends
        first = max(0, begin - STRIP_MARGIN)
        part = match.strip(first, end + STRIP_MARGIN)
        cells, cell_sigma = believed(part.found_px, refine_match(part), model=LIVE, settings=settings)
        own = slice(2 * begin, 2 * end)
        for source, bend, target in ((cells, LARGEST_BEND_PX, residual), (cell_sigma, np.inf, sigma)):
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
    )


def compile_kernels() -> None:
    """Compile what depth needs, once on a machine: else its first map takes some seconds more."""
    image = np.random.default_rng(0).integers(0, 255, (64, 64), dtype=np.uint8)
    valid = np.ones(image.shape, dtype=np.bool_)
    match_live(
        RectifiedPair(
            left=image,
            right=image,
            valid_left=valid,
            valid_right=valid,
            f_px=1_000.0,
            baseline_m=0.2,
            u0_left_px=0.0,
            u0_right_px=-20.0,
            v0_px=0.0,
            pose_sigma_px=0.0,
            t_ns=0,
        )
    )
