"""Factory of the image trackers, and their adapter to binned images."""

from collections.abc import Sequence

import cv2
import numpy as np

from foveacam_hardware.contract import Binning
from foveacam_pipeline.geometry.binning import picture_px, sensor_px
from foveacam_pipeline.track.correlation_filter import CorrelationFilterTracker
from foveacam_pipeline.track.image_tracker import (
    GreyImage,
    ImageTracker,
    TrackBox,
    TrackerKind,
    TrackMatch,
    check_inside,
)
from foveacam_pipeline.track.template_tracker import TemplateTracker


class BinnedTracker:
    """Adapter of a tracker to binned images; boxes and positions are in pixels of the sensor.

    Images of another binning than the first are resized to its size.
    """

    def __init__(self, tracker: ImageTracker, binning: Binning) -> None:
        """`binning`: of the first image."""
        self._tracker = tracker
        self._binning = binning
        self._size = (0, 0)

    def start(self, image: GreyImage, box: TrackBox) -> None:
        """Learn the target; raise `OutOfRange` where the box is not inside the image."""
        self._size = width, height = (image.shape[1], image.shape[0])
        check_inside(box, columns=self._binning * width, rows=self._binning * height)
        x_px, y_px = self._picture(box.x_px, box.y_px)
        self._tracker.start(
            image,
            TrackBox(
                x_px=x_px,
                y_px=y_px,
                width_px=box.width_px // self._binning,
                height_px=box.height_px // self._binning,
            ),
        )

    def update(self, image: GreyImage, near: tuple[float, float] | None) -> TrackMatch | None:
        """Return the target's position; None if it is not found."""
        if image.shape[1::-1] != self._size:
            image = np.asarray(cv2.resize(image, self._size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
        match = self._tracker.update(image, None if near is None else self._picture(*near))
        if match is None:
            return None
        x_px, y_px = sensor_px(np.array([match.x_px, match.y_px]), self._binning).tolist()
        return TrackMatch(x_px=x_px, y_px=y_px, score=match.score)

    def avoid(self, places_px: Sequence[tuple[float, float]]) -> None:
        """Set where other targets are, px: a lost target is not found there."""
        self._tracker.avoid([self._picture(x_px, y_px) for x_px, y_px in places_px])

    def refuse(self) -> None:
        """Reject the last match as another object; the target is then searched for elsewhere."""
        self._tracker.refuse()

    def _picture(self, x_px: float, y_px: float) -> tuple[float, float]:
        x, y = picture_px(np.array([x_px, y_px]), self._binning).tolist()
        return x, y


def start_tracker(
    kind: TrackerKind, image: GreyImage, box: TrackBox, *, binning: Binning = 1
) -> ImageTracker:
    """Return a tracker that has learned the box's content; raise `OutOfRange` if that has no texture.

    `box`: px of the sensor, like all positions that the tracker returns; `binning`: of the image.
    """
    tracker: ImageTracker = TemplateTracker() if kind is TrackerKind.TEMPLATE else CorrelationFilterTracker()
    binned = BinnedTracker(tracker, binning)
    binned.start(image, box)
    return binned
