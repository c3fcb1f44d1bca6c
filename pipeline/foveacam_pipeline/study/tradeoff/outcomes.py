"""One scene at one budget (Sec. 4.2): medium resolution (MR) against backdrop and patches (FOV).

Both are judged on the same native pixels: all with a true depth that both eyes see, matched or not. The
depth estimators are interchangeable: any `DisparityEstimator`, by default the project's semi-global matcher.
"""

from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.stereo.match import match
from foveacam_pipeline.stereo.search import MatchSettings
from foveacam_pipeline.stereo.values import RectifiedPair
from foveacam_pipeline.study.tradeoff.depth_metrics import BINS, BinScores, bin_means, bin_scores, depth_bins
from foveacam_pipeline.study.tradeoff.patches import (
    Disparity,
    Floats,
    PatchChoice,
    PatchPosition,
    PictureSize,
    PixelBudget,
    choose_patches,
    covered_mask,
    enlarged,
    filled,
    resized,
)
from foveacam_pipeline.study.tradeoff.streets import FARTHEST_M, StereoScene


@dataclass(frozen=True, slots=True, kw_only=True)
class StereoView:
    """A rectified pair, the input of an estimator.

    `left`, `right`: (h, w, 3) uint8 RGB. `offset_px`: how much farther left the right image's window lies;
    total disparity = estimate + offset. `near_m`, `far_m`: range to search, `far_m` None for infinity.
    """

    left: NDArray[np.uint8]
    right: NDArray[np.uint8]
    f_px: float
    baseline_m: float
    offset_px: float = 0.0
    near_m: float
    far_m: float | None = None


class DisparityEstimator(Protocol):
    """Estimates disparity; `name` appears in the results."""

    @property
    def name(self) -> str:
        """The estimator's name."""
        ...

    def disparity_px(self, view: StereoView) -> Disparity:
        """Return (h, w) float32 disparity between the two windows, px, NaN where none is found."""
        ...


def estimate_disparity(estimator: DisparityEstimator, view: StereoView) -> Disparity:
    """Return the estimator's map; raise InvalidInput where its size is not the left image's."""
    found = estimator.disparity_px(view)
    if found.shape != view.left.shape[:2]:
        raise InvalidInput(
            f"the estimator '{estimator.name}' gave disparities of shape {found.shape} for a left image of "
            f"{view.left.shape[:2]}; it must give one for every pixel"
        )
    return np.asarray(found, dtype=np.float32)


@dataclass(frozen=True, slots=True, kw_only=True)
class SemiGlobal:
    """The matcher of live depth (`stereo.match`), with speckles small enough for small pictures."""

    name: str = "SGBM with sub-pixel refinement"
    settings: MatchSettings = field(default_factory=lambda: MatchSettings(speckle_px=40))

    def disparity_px(self, view: StereoView) -> Disparity:
        """Return the disparity map, NaN where its own error is too large."""
        everywhere = np.ones(view.left.shape[:2], dtype=np.bool_)
        pair = RectifiedPair(
            left=view.left,
            right=view.right,
            valid_left=everywhere,
            valid_right=everywhere,
            f_px=view.f_px,
            baseline_m=view.baseline_m,
            u0_left_px=view.offset_px,
            u0_right_px=0.0,
            v0_px=0.0,
            pose_sigma_px=0.0,
            t_ns=0,
        )
        settings = replace(self.settings, near_m=view.near_m, far_m=view.far_m)
        return match(pair, settings).residual_px


WINDOW_PERCENTILES = (2.0, 98.0)
"""A patch is searched within these percentiles of the backdrop's disparities; the rest are likely wrong."""
MARGIN_BACKDROP_PX = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneOutcome:
    """Result of one scene: scores of both configurations, and the share of each bin that patches cover."""

    mr: BinScores
    fov: BinScores
    coverage: Floats
    places: tuple[PatchPosition, ...]
    bin_depth_m: Floats
    """(bins,) mean true depth of each bin."""


def scene_outcomes(
    scene: StereoScene, sizes: PixelBudget, estimator: DisparityEstimator
) -> dict[PatchChoice, SceneOutcome]:
    """Return the outcome for both choices of patches. Raise InvalidInput where truth is missing."""
    counted = judged_pixels(scene)
    truth_m = scene.truth_z_m[counted].astype(np.float64)
    bin_of = depth_bins(truth_m)

    def scores(disparity: Disparity) -> BinScores:
        return bin_scores(depth_from_disparity(disparity, scene)[counted], truth_m, bin_of)

    mr = scores(enlarged(filled(uniform_disparity(scene, sizes.medium, estimator)), sizes.native))
    found = uniform_disparity(scene, sizes.backdrop, estimator)
    backdrop = enlarged(filled(found), sizes.native)
    by_choice = {
        PatchChoice.TRUTH: np.where(counted, scene.truth_z_m, np.nan),
        PatchChoice.ESTIMATE: estimated_depth(found, scene, sizes.native),
    }
    results = {}
    for choice, depth_m in by_choice.items():
        places = choose_patches(depth_m.astype(np.float64), sizes.patch, count=sizes.count)
        fused = fused_disparity(scene, backdrop, places, sizes, estimator)
        covered = covered_mask(places, sizes.patch, sizes.native)[counted]
        results[choice] = SceneOutcome(
            mr=mr,
            fov=scores(fused),
            coverage=bin_means(covered.astype(np.float64), bin_of, bins=BINS),
            places=places,
            bin_depth_m=bin_means(truth_m, bin_of),
        )
    return results


def judged_pixels(scene: StereoScene) -> NDArray[np.bool_]:
    """Return (h, w) bool: the pixels that are judged. Raise InvalidInput where there are none."""
    counted = np.isfinite(scene.truth_z_m) & scene.seen
    if not counted.any():
        raise InvalidInput(f"{scene.name} has no pixel with a true depth that both eyes see; leave it out")
    return np.asarray(counted)


def depth_from_disparity(disparity: Disparity, scene: StereoScene) -> Floats:
    """Return (h, w) depth, m, at most `FARTHEST_M`, beyond which the truth is not judged."""
    f_b = scene.f_px * scene.baseline_m
    return np.asarray(f_b / np.maximum(disparity.astype(np.float64), f_b / FARTHEST_M))


def uniform_disparity(scene: StereoScene, size: PictureSize, estimator: DisparityEstimator) -> Disparity:
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
    return estimate_disparity(estimator, view)


def estimated_depth(found: Disparity, scene: StereoScene, native: PictureSize) -> Floats:
    """Return (h, w) depth by the backdrop's disparities, NaN where unknown or beyond `FARTHEST_M`.

    Larger estimates are taken for the sky.
    """
    f_b = scene.f_px * scene.baseline_m
    disparity = enlarged(filled(found), native)
    known = enlarged(np.isfinite(found).astype(np.float32), native) > 0.0
    depth_m = f_b / np.maximum(disparity.astype(np.float64), 1e-6)
    return np.where(known & (depth_m <= FARTHEST_M), depth_m, np.nan)


def fused_disparity(
    scene: StereoScene,
    backdrop: Disparity,
    places: tuple[PatchPosition, ...],
    sizes: PixelBudget,
    estimator: DisparityEstimator,
) -> Disparity:
    """Return the backdrop's native disparity map, replaced by each patch's own where it has one."""
    fused = backdrop.copy()
    margin_px = MARGIN_BACKDROP_PX * sizes.native.width / sizes.backdrop.width
    for place in places:
        window = place.window(sizes.patch)
        view, offset_px = patch_view(scene, backdrop[window], place, sizes.patch, margin_px=margin_px)
        total = estimate_disparity(estimator, view) + np.float32(offset_px)
        fused[window] = np.where(np.isfinite(total), total, fused[window])
    return fused


def patch_view(
    scene: StereoScene, about: Disparity, place: PatchPosition, size: PictureSize, *, margin_px: float
) -> tuple[StereoView, int]:
    """Return a patch of both eyes, the right one shifted by the backdrop's disparity, and the shift.

    It is like verged foveae: the right patch has the size of the left one and shows what lies near that
    depth.
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
