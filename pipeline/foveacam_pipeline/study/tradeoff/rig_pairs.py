"""The trade-off of Sec. 4.2 on the rig's images: a wide pair is the backdrop, verged foveae are the patches.

Both configurations have the same pixels: MR is the wide pair alone, FOV a smaller wide pair and the foveae,
reduced to a quarter of all pixels. A fovea has nine times the wide camera's resolution, so even reduced it is
far finer.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.stereo.values import RectifiedPair
from foveacam_pipeline.study.tradeoff.depth_metrics import BINS, BinScores, bin_means, bin_scores, depth_bins
from foveacam_pipeline.study.tradeoff.outcomes import (
    MARGIN_BACKDROP_PX,
    WINDOW_PERCENTILES,
    DisparityEstimator,
    StereoView,
    depth_from_disparity,
    estimate_disparity,
    judged_pixels,
    uniform_disparity,
)
from foveacam_pipeline.study.tradeoff.patches import (
    PATCH_SHARE,
    Disparity,
    Floats,
    PictureSize,
    enlarged,
    filled,
    resized,
    scaled,
)
from foveacam_pipeline.study.tradeoff.streets import StereoScene


@dataclass(frozen=True, slots=True, kw_only=True)
class RigPairScene:
    """Images of the rig with the true depth.

    `wide`: a pair of the wide camera moved to the foveae's virtual pinholes, half a baseline to
    either side (the linear stage of Fig. 4); its truth belongs to its left image. `centre_px`: the principal
    point (x, y) of both. `foveae`: native rectified pairs of fixations in the same world.
    """

    wide: StereoScene
    centre_px: tuple[float, float]
    foveae: tuple[RectifiedPair, ...]

    def __post_init__(self) -> None:
        """Refuse a scene without foveae, and foveae of another baseline."""
        if not self.foveae:
            raise InvalidInput(f"{self.wide.name} has no foveae; give at least one rectified pair")
        for pair in self.foveae:
            if abs(pair.baseline_m - self.wide.baseline_m) > 1e-3 * self.wide.baseline_m:
                raise InvalidInput(
                    f"{self.wide.name}: a fovea pair has a baseline of {pair.baseline_m} m, the wide pair "
                    f"one of {self.wide.baseline_m} m; take the wide pair at the foveae's baseline"
                )


@dataclass(frozen=True, slots=True, kw_only=True)
class RigOutcome:
    """Scores on the wide camera's pixels, and AbsRel of those alone that foveae see (NaN if they see none).

    `pixels`: numbers of pixels of one eye, (MR, FOV), after rounding.
    """

    mr: BinScores
    fov: BinScores
    coverage: Floats
    inside_mr_absrel: float
    inside_fov_absrel: float
    inside_share: float
    pixels: tuple[int, int]


def rig_outcome(scene: RigPairScene, estimator: DisparityEstimator, *, share: float = 1.0) -> RigOutcome:
    """Return the outcome of both configurations at `share` of the wide pixels. Raise InvalidInput."""
    if not 0.0 < share <= 1.0:
        raise InvalidInput(f"a share of {share} of the wide pixels was given; choose one between 0 and 1")
    wide = scene.wide
    native = PictureSize(width=wide.left.shape[1], height=wide.left.shape[0])
    medium, small = scaled(native, share), scaled(native, share * (1.0 - PATCH_SHARE))
    mr = enlarged(filled(uniform_disparity(wide, medium, estimator)), native)
    fused = enlarged(filled(uniform_disparity(wide, small, estimator)), native)
    inside, spent = np.zeros(fused.shape, dtype=np.bool_), small.pixels
    for pair in scene.foveae:
        size = _fovea_size(pair, (medium.pixels - small.pixels) / len(scene.foveae))
        spent += size.pixels
        margin_px = MARGIN_BACKDROP_PX * native.width / small.width
        seen, found = _foveated(scene, pair, size, fused, estimator, margin_px=margin_px)
        inside |= seen
        fused = np.where(np.isfinite(found), found, fused)
    return _judged(wide, mr, fused, inside, pixels=(medium.pixels, spent))


def _fovea_size(pair: RectifiedPair, pixels: float) -> PictureSize:
    """Return the size to which a fovea is reduced; it is never enlarged."""
    native = PictureSize(width=pair.left.shape[1], height=pair.left.shape[0])
    return scaled(native, min(1.0, pixels / native.pixels))


def _foveated(
    scene: RigPairScene,
    pair: RectifiedPair,
    size: PictureSize,
    backdrop: Disparity,
    estimator: DisparityEstimator,
    *,
    margin_px: float,
) -> tuple[NDArray[np.bool_], Disparity]:
    """Return which wide pixels (h, w) the fovea sees, and their disparity by it, NaN where it has none."""
    columns, rows = _fovea_pixels(scene, pair)
    height, width = pair.left.shape[:2]
    inside = (columns >= 0.0) & (columns <= width - 1.0) & (rows >= 0.0) & (rows <= height - 1.0)
    if not inside.any():
        return inside, np.full(backdrop.shape, np.nan, dtype=np.float32)
    f_b = scene.wide.f_px * scene.wide.baseline_m
    least, most = np.percentile(backdrop[inside], WINDOW_PERCENTILES)
    ratio = size.width / width
    view = StereoView(
        left=resized(_rgb(pair.left), size),
        right=resized(_rgb(pair.right), size),
        f_px=pair.f_px * ratio,
        baseline_m=pair.baseline_m,
        offset_px=pair.offset_px * ratio,
        near_m=f_b / (most + margin_px),
        far_m=f_b / max(least - margin_px, 1e-3),
    )
    total = (estimate_disparity(estimator, view) + np.float32(view.offset_px)) * np.float32(
        scene.wide.f_px / view.f_px
    )
    valid = cv2.resize(pair.valid_left.view(np.uint8), (size.width, size.height)) > 0
    total = np.where(valid, total, np.float32(np.nan))
    at = [
        ((place + 0.5) * (reduced / full) - 0.5).astype(np.float32)
        for place, reduced, full in ((columns, size.width, width), (rows, size.height, height))
    ]
    found = cv2.remap(
        total, at[0], at[1], cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT, borderValue=[np.nan]
    )
    return inside, np.where(inside, found, np.float32(np.nan))


def _fovea_pixels(scene: RigPairScene, pair: RectifiedPair) -> tuple[Floats, Floats]:
    """Return (h, w) columns and rows of the native left window at which each wide pixel looks.

    Both pinholes are at the same point and parallel: only scale and origin differ (Sec. 3.2).
    """
    zoom = pair.f_px / scene.wide.f_px
    height, width = scene.wide.truth_z_m.shape
    columns = (np.arange(width) - scene.centre_px[0]) * zoom - pair.u0_left_px
    rows = (np.arange(height) - scene.centre_px[1]) * zoom - pair.v0_px
    across, down = np.meshgrid(columns, rows)
    return across, down


def _rgb(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return image if image.ndim == 3 else np.repeat(image[:, :, None], 3, axis=2)


def _judged(
    wide: StereoScene, mr: Disparity, fov: Disparity, inside: NDArray[np.bool_], *, pixels: tuple[int, int]
) -> RigOutcome:
    counted = judged_pixels(wide)
    truth_m = wide.truth_z_m[counted].astype(np.float64)
    bin_of = depth_bins(truth_m)
    depths = [depth_from_disparity(disparity, wide)[counted] for disparity in (mr, fov)]
    covered = inside[counted]
    absrel = [
        float(np.mean(np.abs(depth_m - truth_m)[covered] / truth_m[covered])) if covered.any() else np.nan
        for depth_m in depths
    ]
    return RigOutcome(
        mr=bin_scores(depths[0], truth_m, bin_of),
        fov=bin_scores(depths[1], truth_m, bin_of),
        coverage=bin_means(covered.astype(np.float64), bin_of, bins=BINS),
        inside_mr_absrel=absrel[0],
        inside_fov_absrel=absrel[1],
        inside_share=float(covered.mean()),
        pixels=pixels,
    )
