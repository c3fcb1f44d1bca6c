"""Settings of the search for disparities, the range that a caller sets, and OpenCV's matcher.

`coarse` finds the range of a scene whose caller sets none.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.stereo.values import RectifiedPair

STEP = 16
"""OpenCV counts disparities in sixteens, and stores them in sixteenths."""
MAX_DISPARITIES = 256
FALLBACK_DISPARITIES = 128
"""Number searched about the verged depth when the coarse search finds too little."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MatchSettings:
    """Settings of the matcher; px at the window's scale.

    `near_m`, `far_m`: range of depths (along z) to search, limited to 256 disparities. `disparities`: number
    to search, centred on the verged depth. If none is set, the coarse search finds the range of the scene.
    Disparities beyond infinity are not searched.
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
        """Whether no range is set, so that the coarse search finds it."""
        return self.near_m is None and self.far_m is None and self.disparities is None


DEFAULT = MatchSettings()


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


def window(between_px: tuple[float, float]) -> tuple[int, int]:
    """Return the first disparity and their number, a multiple of 16, that hold a span, px."""
    first = math.floor(between_px[0])
    return first, rounded_count(math.ceil(between_px[1]) - first)


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


def rounded_count(count: int) -> int:
    """Return the least multiple of 16, at least 16, that is not below a number of disparities."""
    return STEP * max(1, math.ceil(count / STEP))


def _positive(depth_m: float) -> float:
    if not depth_m > 0.0:
        raise InvalidInput(f"stereo search limit {depth_m} m: a depth in front of the rig (> 0 m) is needed")
    return depth_m
