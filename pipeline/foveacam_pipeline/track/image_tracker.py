"""What trackers of one target in a sequence of images share: the box, the match, the interface."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import OutOfRange

GreyImage: TypeAlias = NDArray[np.uint8]
"""A grey image, (h, w) uint8."""
LEAST_SIDE_PX = 9


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackBox:
    """A target's box in an image: its centre (centre of the first pixel is 0, 0) and its sides, px."""

    x_px: float
    y_px: float
    width_px: int = 64
    height_px: int = 64


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackMatch:
    """Where a tracker finds its target, px, and how well: 1 is the best score, whatever the tracker."""

    x_px: float
    y_px: float
    score: float


class TrackerKind(StrEnum):
    """The image trackers."""

    TEMPLATE = "template"
    """Correlation with the first picture and with a slowly renewed one; finds a lost target again."""
    FILTER = "filter"
    """Kernelised correlation filter: learns with every image, does not search far."""


class ImageTracker(Protocol):
    """Follows one target through grey images of one size."""

    def start(self, image: GreyImage, box: TrackBox) -> None:
        """Learn the target; raise `OutOfRange` where the box is not inside the image."""
        ...

    def update(self, image: GreyImage, near: tuple[float, float] | None) -> TrackMatch | None:
        """Return where the target is; None where it is not found.

        `near`: where it is expected, px; None: where it was found last.
        """
        ...

    def refuse(self) -> None:
        """Take it that the last match was another thing: the target is searched for elsewhere."""
        ...


def check_inside(box: TrackBox, *, columns: int, rows: int) -> None:
    """Raise `OutOfRange` unless a box lies inside an image of `columns` x `rows` px."""
    width, height = max(LEAST_SIDE_PX, box.width_px) | 1, max(LEAST_SIDE_PX, box.height_px) | 1
    if not (width / 2 <= box.x_px <= columns - width / 2 and height / 2 <= box.y_px <= rows - height / 2):
        raise OutOfRange(
            f"a box of {width} x {height} px about ({box.x_px:.0f}, {box.y_px:.0f}) is not inside the "
            f"image of {columns} x {rows} px; choose a smaller box or a place farther inside"
        )


def cut_box(
    image: GreyImage, *, x_px: float, y_px: float, width_px: int, height_px: int
) -> NDArray[np.float32]:
    """Return the box about a place to a fraction of a pixel, (h, w) float32; the rim is continued."""
    part = cv2.getRectSubPix(image, (width_px, height_px), (x_px, y_px), patchType=cv2.CV_32F)
    return np.asarray(part, dtype=np.float32)
