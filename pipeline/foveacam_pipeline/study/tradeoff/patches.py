"""A budget of pixels (Sec. 4.2): one uniform medium resolution, or a backdrop and native patches.

Here are the sizes, the choice of patches, and resizing and filling of disparity maps; matching is elsewhere.
"""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput

Floats: TypeAlias = NDArray[np.float64]
Disparity: TypeAlias = NDArray[np.float32]
"""(h, w) float32 px; NaN where none is known."""
PATCH_SHARE = 0.25  # of the pixels (Sec. 4.2)
PATCH_ASPECT = 4.0 / 3.0
"""Width over height, the shape of a fovea's frame."""
LEAST_SIDE_PX = 16


class PatchChoice(StrEnum):
    """The depth by which patches are chosen: the truth, or, as a robot must, the backdrop's own estimate."""

    TRUTH = "truth"
    ESTIMATE = "estimate"


@dataclass(frozen=True, slots=True, kw_only=True)
class PictureSize:
    """Size of an image, px."""

    width: int
    height: int

    @property
    def pixels(self) -> int:
        """The number of pixels."""
        return self.width * self.height


@dataclass(frozen=True, slots=True, kw_only=True)
class PixelBudget:
    """Sizes of both configurations, one eye: `medium` alone, or `backdrop` and `count` patches."""

    native: PictureSize
    medium: PictureSize
    backdrop: PictureSize
    patch: PictureSize
    count: int

    @property
    def fov_pixels(self) -> int:
        """Pixels of backdrop and patches together."""
        return self.backdrop.pixels + self.count * self.patch.pixels

    @property
    def imbalance(self) -> float:
        """Relative excess of FOV's pixels over MR's, due to rounding."""
        return self.fov_pixels / self.medium.pixels - 1.0


def scaled(size: PictureSize, share: float) -> PictureSize:
    """Return the size that has about that share of the pixels, width and height scaled alike."""
    factor = math.sqrt(share)
    return PictureSize(width=round(size.width * factor), height=round(size.height * factor))


def budget(
    native: PictureSize, share: float, *, patches: int, patch_share: float = PATCH_SHARE
) -> PixelBudget:
    """Return the sizes for `share` of the native pixels; patches share what the backdrop leaves.

    Raise InvalidInput for a share outside 0 to 1, and where patches would be too small to match in.
    """
    if not 0.0 < share <= 1.0 or not 0.0 < patch_share < 1.0:
        raise InvalidInput(f"shares of {share} and {patch_share} were given; choose between 0 and 1")
    if patches < 1:
        raise InvalidInput(f"{patches} patches were asked for; at least 1 is needed")
    medium, backdrop = scaled(native, share), scaled(native, share * (1.0 - patch_share))
    each = (medium.pixels - backdrop.pixels) / patches
    height = max(1, round(math.sqrt(each / PATCH_ASPECT)))
    patch = PictureSize(width=round(each / height), height=height)
    if min(patch.width, patch.height) < LEAST_SIDE_PX:
        raise InvalidInput(
            f"{patches} patches in {share:.3g} of the pixels would be {patch.width} x {patch.height} px "
            f"each; {LEAST_SIDE_PX} px are needed each way: give more pixels or fewer patches"
        )
    return PixelBudget(native=native, medium=medium, backdrop=backdrop, patch=patch, count=patches)


@dataclass(frozen=True, slots=True, kw_only=True)
class PatchPosition:
    """The upper left pixel of a patch in the native image."""

    x_px: int
    y_px: int

    def window(self, size: PictureSize) -> tuple[slice, slice]:
        """Return the rows and columns of the patch."""
        return slice(self.y_px, self.y_px + size.height), slice(self.x_px, self.x_px + size.width)


def choose_patches(depth_m: Floats, size: PictureSize, *, count: int) -> tuple[PatchPosition, ...]:
    """Return the positions of the patches, chosen one after the other, each where most depth error is left.

    `depth_m`: (h, w) of the native image, NaN where unknown or not counted. Matching errs in depth as Z²
    (Sec. 4.1), so the patch that covers the largest sum of Z² comes first; what it covers is not counted
    again.
    """
    worth = np.nan_to_num(depth_m) ** 2
    height, width = worth.shape
    if size.height > height or size.width > width:
        raise InvalidInput(
            f"patches of {size.width} x {size.height} px do not fit into {width} x {height} px; "
            "give fewer pixels"
        )
    chosen = []
    for _ in range(count):
        sums = cv2.integral(worth)
        covered = (
            sums[size.height :, size.width :]
            - sums[: -size.height, size.width :]
            - sums[size.height :, : -size.width]
            + sums[: -size.height, : -size.width]
        )
        y_px, x_px = np.unravel_index(int(np.argmax(covered)), covered.shape)
        patch = PatchPosition(x_px=int(x_px), y_px=int(y_px))
        worth[patch.window(size)] = 0.0
        chosen.append(patch)
    return tuple(chosen)


def covered_mask(
    places: tuple[PatchPosition, ...], size: PictureSize, native: PictureSize
) -> NDArray[np.bool_]:
    """Return (h, w) bool: native pixels that lie in a patch."""
    mask = np.zeros((native.height, native.width), dtype=np.bool_)
    for place in places:
        mask[place.window(size)] = True
    return mask


def resized(image: NDArray[np.uint8], size: PictureSize) -> NDArray[np.uint8]:
    """Return the image averaged down to exactly that size.

    Both eyes use the size: given a factor, OpenCV would scale by the factor, not by the rounded size.
    """
    return np.asarray(cv2.resize(image, (size.width, size.height), interpolation=cv2.INTER_AREA), np.uint8)


def enlarged(disparity: Disparity, size: PictureSize) -> Disparity:
    """Return a disparity map at that size, its values multiplied by the ratio of the widths."""
    ratio = size.width / disparity.shape[1]
    grown = cv2.resize(disparity, (size.width, size.height), interpolation=cv2.INTER_LINEAR)
    return np.asarray(grown * np.float32(ratio), dtype=np.float32)


def filled(disparity: Disparity) -> Disparity:
    """Return the map with every unknown pixel set to the smaller of the next known ones in its row.

    Hidden or unmatched pixels usually belong to the background. A row without known pixels is copied from the
    nearest row that has some. Raise InvalidInput where no pixel is known.
    """
    known = np.isfinite(disparity)
    if not known.any():
        raise InvalidInput("the stereo matcher found no disparity at all; give pictures with texture")
    from_left, from_right = _carried(disparity), _carried(disparity[:, ::-1])[:, ::-1]
    full = np.fmin(from_left, from_right)
    rows = np.nonzero(known.any(axis=1))[0]
    nearest = rows[np.argmin(np.abs(np.arange(len(full))[:, None] - rows[None, :]), axis=1)]
    return np.asarray(full[nearest], dtype=np.float32)


def _carried(disparity: Disparity) -> Disparity:
    """Return the map with each row's last known value continued to the right, NaN before the first."""
    columns = np.arange(disparity.shape[1])[None, :]
    last = np.maximum.accumulate(np.where(np.isfinite(disparity), columns, 0), axis=1)
    return np.asarray(np.take_along_axis(disparity, last, axis=1))
