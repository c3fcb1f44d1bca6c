"""Interface and value types of single-target image trackers."""

from collections.abc import Sequence
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
    """Position of the target, px, and score of the match; the best score is 1 for every tracker."""

    x_px: float
    y_px: float
    score: float


class TrackerKind(StrEnum):
    """Implementations of `ImageTracker`."""

    TEMPLATE = "template"
    """Correlation with the first template and a slowly updated one; finds a lost target again."""
    FILTER = "filter"
    """Kernelised correlation filter: updated with every image, has a short search range."""


class ImageTracker(Protocol):
    """Follows one target through grey images of one size."""

    def start(self, image: GreyImage, box: TrackBox) -> None:
        """Learn the target; raise `OutOfRange` where the box is not inside the image."""
        ...

    def update(self, image: GreyImage, near: tuple[float, float] | None) -> TrackMatch | None:
        """Return the target's position; None if it is not found.

        `near`: its expected position, px; None: where it was found last.
        """
        ...

    def avoid(self, places_px: Sequence[tuple[float, float]]) -> None:
        """Set where other targets are, px: a lost target is not found there."""
        ...

    def refuse(self) -> None:
        """Reject the last match as another object; the target is then searched for elsewhere."""
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
    """Return the patch about a sub-pixel centre, (h, w) float32; beyond the image its border is repeated."""
    part = cv2.getRectSubPix(image, (width_px, height_px), (x_px, y_px), patchType=cv2.CV_32F)
    return np.asarray(part, dtype=np.float32)
