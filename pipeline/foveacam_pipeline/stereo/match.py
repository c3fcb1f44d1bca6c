"""Signed disparity of a rectified pair: semi-global matching in a window about the verged depth.

OpenCV's matcher finds whole disparities, checks them left against right and drops speckles; `refine` then
measures each pixel's sub-pixel remainder and its error. Knows nothing of metres beyond the search window.
"""

import math
import time
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.stereo.refine import refine
from foveacam_pipeline.stereo.values import DisparityMap, RectifiedPair

STEP = 16
"""OpenCV counts disparities in sixteens, and stores them in sixteenths."""
MAX_DISPARITIES = 256


@dataclass(frozen=True, slots=True, kw_only=True)
class MatchSettings:
    """How to search; px at the window's scale.

    `disparities`: how many whole disparities to search, centred on the verged depth. `near_m`, `far_m`:
    search this range of depths (along z) instead, as far as 256 disparities reach. Beyond infinity nothing
    is searched.
    """

    disparities: int = 128
    near_m: float | None = None
    far_m: float | None = None
    block: int = 5
    uniqueness_percent: int = 10
    speckle_px: int = 150
    max_sigma_px: float = 1.1
    """A pixel whose own error is larger is called unknown: nothing there to match."""


DEFAULT = MatchSettings()


def match(pair: RectifiedPair, settings: MatchSettings = DEFAULT) -> DisparityMap:
    """Return the signed residual disparity of every left pixel, its error, and NaN where unknown."""
    started = time.perf_counter()
    prepared = prepare(pair, settings)
    raw = np.asarray(prepared.matcher.compute(prepared.left, prepared.right), dtype=np.int16)
    width = pair.left.shape[1]
    whole = raw[:, prepared.pad_left : prepared.pad_left + width]
    gray_left = prepared.left[:, prepared.pad_left : prepared.pad_left + width]
    gray_right = prepared.right[:, prepared.pad_left : prepared.pad_left + width]
    known = (whole >= prepared.first * STEP) & pair.valid_left
    residual, sigma, seen = refine(gray_left, gray_right, whole, pair.valid_right)
    known &= seen & (sigma <= settings.max_sigma_px)
    residual[~known] = np.nan
    sigma[~known] = np.nan
    return DisparityMap(
        residual_px=residual, sigma_px=sigma, compute_ms=(time.perf_counter() - started) * 1e3
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Prepared:
    """What goes into OpenCV's matcher: grey images with margins, so that border pixels are searched too."""

    matcher: cv2.StereoSGBM
    left: NDArray[np.uint8]
    right: NDArray[np.uint8]
    pad_left: int
    first: int


def prepare(pair: RectifiedPair, settings: MatchSettings = DEFAULT) -> Prepared:
    """Choose the search window and lay out the images for one call of the matcher."""
    first, count = search_window(pair, settings)
    pad_left, pad_right = max(0, first + count - 1), max(0, -first)
    left, right = (
        cv2.copyMakeBorder(gray(image), 0, 0, pad_left, pad_right, cv2.BORDER_REPLICATE)
        for image in (pair.left, pair.right)
    )
    matcher = cv2.StereoSGBM.create(
        minDisparity=first,
        numDisparities=count,
        blockSize=settings.block,
        P1=8 * settings.block**2,
        P2=32 * settings.block**2,
        disp12MaxDiff=1,
        preFilterCap=31,
        uniquenessRatio=settings.uniqueness_percent,
        speckleWindowSize=settings.speckle_px,
        speckleRange=2,
        mode=cv2.StereoSGBM_MODE_SGBM_3WAY,
    )
    return Prepared(
        matcher=matcher,
        left=np.asarray(left, dtype=np.uint8),
        right=np.asarray(right, dtype=np.uint8),
        pad_left=pad_left,
        first=first,
    )


def search_window(pair: RectifiedPair, settings: MatchSettings = DEFAULT) -> tuple[int, int]:
    """Return the first residual disparity to search and how many: a multiple of 16, at most 256."""
    low, high = -settings.disparities / 2, settings.disparities / 2
    f_b = pair.f_px * pair.baseline_m
    if settings.near_m is not None:
        high = f_b / _positive(settings.near_m) - pair.offset_px
    if settings.far_m is not None:
        low = f_b / _positive(settings.far_m) - pair.offset_px
    first = math.floor(max(low, -pair.offset_px))
    if high <= first:
        raise InvalidInput(
            f"stereo search from {settings.near_m} m to {settings.far_m} m holds no disparity: near must be "
            f"nearer than far and than infinity (verged: {pair.verged_z_m:.2f} m); swap or widen them"
        )
    count = STEP * max(1, math.ceil((math.ceil(high) - first) / STEP))
    return first, min(MAX_DISPARITIES, count)


def gray(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return (h, w) uint8 luminance of a grey or RGB image."""
    if image.ndim == 2:
        return image
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), dtype=np.uint8)


def _positive(depth_m: float) -> float:
    if not depth_m > 0.0:
        raise InvalidInput(f"stereo search limit {depth_m} m: a depth in front of the rig (> 0 m) is needed")
    return depth_m
