"""Decide whether a match is of the point itself or of another surface in its window.

A match of two pictures is dominated by what has texture in its window. Here both pictures are aligned by the
match and compared in windows of a wide pixel: a point that differs belongs to another surface; a blank one
belongs to the matched surface only when that surrounds it.
"""

from dataclasses import dataclass, replace
from enum import Enum

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Binning

ALIKE = 0.6
"""Least local correlation at which both pictures show the same."""
DIFFERENT = 0.3
"""Local correlation below which they show different things."""
SECTORS = 8
"""Sectors around the point; with matched texture in all of them a blank point lies within the surface."""
MIXED_SHARE = 0.1
"""A point of which a larger share differs lies on the edge of another surface."""


class MatchSupport(Enum):
    """Whether a match is of the point in the middle of its window."""

    MATCHED = "matched"
    """The point itself has texture, the same in both pictures."""
    ENCLOSED = "enclosed"
    """The point is blank, with matched texture all around it."""
    BESIDE = "beside"
    """The point is blank, with matched texture on some sides only: it may be of another surface."""
    DIFFERENT = "different"
    """The point itself differs between the pictures: it is of another surface."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SupportScale:
    """Sizes in px of the pictures compared, or of the sensor that they bin.

    `window_sigma_px`: of the local comparison. `point_px`: radius that counts as the point itself.
    `around_px`: radius of its surroundings. `texture_std`: least local standard deviation of texture.
    """

    window_sigma_px: float
    point_px: float
    around_px: float
    texture_std: float

    def binned(self, binning: Binning) -> "SupportScale":
        """Return the sizes in px of a binned picture."""
        return replace(
            self,
            window_sigma_px=self.window_sigma_px / binning,
            point_px=self.point_px / binning,
            around_px=self.around_px / binning,
        )


FOVEA_SCALE = SupportScale(window_sigma_px=4.5, point_px=7.0, around_px=48.0, texture_std=0.4)
SURVEY_SCALE = SupportScale(window_sigma_px=2.5, point_px=3.0, around_px=24.0, texture_std=0.35)


@dataclass(frozen=True, slots=True, kw_only=True)
class SupportReport:
    """Support of a match, and the number of sectors around the point with matched texture.

    `alike_offset_px`: (x, y) from the point to the middle of the matched texture around it.
    """

    support: MatchSupport
    sectors: int
    alike_offset_px: tuple[float, float]


def support_of(one: NDArray[np.float32], other: NDArray[np.float32], *, scale: SupportScale) -> SupportReport:
    """Return the support of the point in the middle of two pictures, equalised and aligned by the match."""
    correlation, texture = _local(one, other, scale)
    radius_px, angle_rad = _polar(one.shape)
    alike = (texture >= scale.texture_std) & (correlation >= ALIKE)
    different = (texture >= scale.texture_std) & (correlation < DIFFERENT)
    point = radius_px <= scale.point_px
    alike_share, different_share = float(alike[point].mean()), float(different[point].mean())
    sector = np.floor((angle_rad + np.pi) / (2.0 * np.pi) * SECTORS).astype(np.intp) % SECTORS
    around = alike & (radius_px <= scale.around_px)
    sectors = int(np.count_nonzero(np.bincount(sector[around], minlength=SECTORS)))
    return SupportReport(
        support=_verdict(alike_share, different_share, sectors),
        sectors=sectors,
        alike_offset_px=_middle(around),
    )


def _verdict(alike_share: float, different_share: float, sectors: int) -> MatchSupport:
    if different_share > MIXED_SHARE:
        return MatchSupport.DIFFERENT
    if alike_share >= 0.5:
        return MatchSupport.MATCHED
    return MatchSupport.ENCLOSED if sectors == SECTORS else MatchSupport.BESIDE


def _middle(mask: NDArray[np.bool_]) -> tuple[float, float]:
    """Return the centroid of a mask from its middle, px; (0, 0) when the mask is empty."""
    ys, xs = np.nonzero(mask)
    if len(xs) == 0:
        return 0.0, 0.0
    return float(xs.mean()) - (mask.shape[1] - 1) / 2, float(ys.mean()) - (mask.shape[0] - 1) / 2


def _local(
    one: NDArray[np.float32], other: NDArray[np.float32], scale: SupportScale
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the local correlation and the lower local standard deviation of two pictures, (h, w) each."""
    size, sigma = (0, 0), scale.window_sigma_px
    mean_one, mean_other = cv2.GaussianBlur(one, size, sigma), cv2.GaussianBlur(other, size, sigma)
    variance_one = cv2.GaussianBlur(one * one, size, sigma) - mean_one * mean_one
    variance_other = cv2.GaussianBlur(other * other, size, sigma) - mean_other * mean_other
    shared = cv2.GaussianBlur(one * other, size, sigma) - mean_one * mean_other
    least = np.float32(1e-6)
    norm = np.sqrt(np.maximum(variance_one, least) * np.maximum(variance_other, least))
    weaker = np.sqrt(np.maximum(np.minimum(variance_one, variance_other), least))
    return np.asarray(shared / norm, dtype=np.float32), np.asarray(weaker, dtype=np.float32)


def _polar(shape: tuple[int, ...]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return each pixel's distance from the middle, px, and its direction, rad."""
    y, x = np.indices(shape, dtype=np.float64)
    y -= (shape[0] - 1) / 2
    x -= (shape[1] - 1) / 2
    return np.hypot(x, y), np.arctan2(y, x)
