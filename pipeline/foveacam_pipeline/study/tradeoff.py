"""One scene at one budget, both ways (Sec. 4.2): medium resolution (MR) against backdrop and patches (FOV).

Both are judged on the same native pixels: those with a true depth that both eyes see, known or not.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.study.depth_metrics import BINS, BinScores, bin_means, bin_scores, depth_bins
from foveacam_pipeline.study.near_far_scenes import FARTHEST_M, StereoScene
from foveacam_pipeline.study.patches import (
    Disparity,
    Floats,
    PatchChoice,
    PatchPosition,
    PictureSize,
    PixelBudget,
    choose_patches,
    covered_by,
    enlarged,
    filled,
    resized,
)
from foveacam_pipeline.study.tradeoff_stereo import DisparityEstimator, StereoView, estimated_disparity

WINDOW_PERCENTILES = (2.0, 98.0)
"""A patch is searched about the backdrop's disparities there, but for the few that are most likely wrong."""
MARGIN_BACKDROP_PX = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneOutcome:
    """What one scene gave: scores of both configurations, and the share of each bin that patches cover."""

    mr: BinScores
    fov: BinScores
    coverage: Floats
    places: tuple[PatchPosition, ...]
    bin_depth_m: Floats
    """(bins,) mean true depth of each bin."""


def outcomes(
    scene: StereoScene, sizes: PixelBudget, estimator: DisparityEstimator
) -> dict[PatchChoice, SceneOutcome]:
    """Return what the budget gives, by both choices of patches. Raise InvalidInput where truth is missing."""
    counted = counted_pixels(scene)
    truth_m = scene.truth_z_m[counted].astype(np.float64)
    bin_of = depth_bins(truth_m)

    def scores(disparity: Disparity) -> BinScores:
        return bin_scores(depth_of(disparity, scene)[counted], truth_m, bin_of)

    mr = scores(enlarged(filled(uniform(scene, sizes.medium, estimator)), sizes.native))
    found = uniform(scene, sizes.backdrop, estimator)
    backdrop = enlarged(filled(found), sizes.native)
    by_choice = {
        PatchChoice.TRUTH: np.where(counted, scene.truth_z_m, np.nan),
        PatchChoice.ESTIMATE: estimated_depth(found, scene, sizes.native),
    }
    results = {}
    for choice, depth_m in by_choice.items():
        places = choose_patches(depth_m.astype(np.float64), sizes.patch, count=sizes.count)
        fused = with_patches(scene, backdrop, places, sizes, estimator)
        covered = covered_by(places, sizes.patch, sizes.native)[counted]
        results[choice] = SceneOutcome(
            mr=mr,
            fov=scores(fused),
            coverage=bin_means(covered.astype(np.float64), bin_of, bins=BINS),
            places=places,
            bin_depth_m=bin_means(truth_m, bin_of),
        )
    return results


def counted_pixels(scene: StereoScene) -> NDArray[np.bool_]:
    """Return (h, w) bool: pixels that are judged. Raise InvalidInput where there are none."""
    counted = np.isfinite(scene.truth_z_m) & scene.seen
    if not counted.any():
        raise InvalidInput(f"{scene.name} has no pixel with a true depth that both eyes see; leave it out")
    return np.asarray(counted)


def depth_of(disparity: Disparity, scene: StereoScene) -> Floats:
    """Return (h, w) depth, m; nothing is held to be farther away than the truth is counted."""
    f_b = scene.f_px * scene.baseline_m
    return np.asarray(f_b / np.maximum(disparity.astype(np.float64), f_b / FARTHEST_M))


def uniform(scene: StereoScene, size: PictureSize, estimator: DisparityEstimator) -> Disparity:
    """Return the disparity of both images at that size, in its own pixels; NaN where none was found."""
    ratio = size.width / scene.left.shape[1]
    left, right = (resized(image, size) for image in (scene.left, scene.right))
    view = StereoView(
        left=left,
        right=right,
        f_px=scene.f_px * ratio,
        baseline_m=scene.baseline_m,
        near_m=scene.near_m,
    )
    return estimated_disparity(estimator, view)


def estimated_depth(found: Disparity, scene: StereoScene, native: PictureSize) -> Floats:
    """Return (h, w) depth as the backdrop tells it, NaN where it knows none within the range counted.

    What seems farther than that is taken for the sky.
    """
    f_b = scene.f_px * scene.baseline_m
    disparity = enlarged(filled(found), native)
    known = enlarged(np.isfinite(found).astype(np.float32), native) > 0.0
    depth_m = f_b / np.maximum(disparity.astype(np.float64), 1e-6)
    return np.where(known & (depth_m <= FARTHEST_M), depth_m, np.nan)


def with_patches(
    scene: StereoScene,
    backdrop: Disparity,
    places: tuple[PatchPosition, ...],
    sizes: PixelBudget,
    estimator: DisparityEstimator,
) -> Disparity:
    """Return the backdrop's native disparity map with each patch's own where it found one."""
    fused = backdrop.copy()
    margin_px = MARGIN_BACKDROP_PX * sizes.native.width / sizes.backdrop.width
    for place in places:
        window = place.window(sizes.patch)
        view, offset_px = patch_view(scene, backdrop[window], place, sizes.patch, margin_px=margin_px)
        total = estimated_disparity(estimator, view) + np.float32(offset_px)
        fused[window] = np.where(np.isfinite(total), total, fused[window])
    return fused


def patch_view(
    scene: StereoScene, about: Disparity, place: PatchPosition, size: PictureSize, *, margin_px: float
) -> tuple[StereoView, int]:
    """Return a patch of both eyes, the right one shifted as the backdrop's disparity says, and the shift.

    As foveae verge: the right patch has as many pixels as the left one, and holds what lies near that depth.
    """
    f_b = scene.f_px * scene.baseline_m
    least, most = np.percentile(about, WINDOW_PERCENTILES)
    offset_px = min(place.x_px, max(0, int(np.floor(least - margin_px))))
    rows, columns = place.window(size)
    shifted = slice(columns.start - offset_px, columns.stop - offset_px)
    view = StereoView(
        left=np.ascontiguousarray(scene.left[rows, columns]),
        right=np.ascontiguousarray(scene.right[rows, shifted]),
        f_px=scene.f_px,
        baseline_m=scene.baseline_m,
        offset_px=float(offset_px),
        near_m=f_b / (max(most, offset_px) + margin_px),
        far_m=f_b / max(least - margin_px, 1e-3),
    )
    return view, offset_px
