"""Every fovea of every scan on the rail: where it stood, where it looked, its picture."""

from collections import OrderedDict
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.capture.dataset.reader import Dataset, DatasetPoint
from foveacam_pipeline.capture.mosaic.look import EyeLook
from foveacam_pipeline.capture.rail_stops import EYES, RailStop
from foveacam_pipeline.capture.reference.values import Floats, ReferenceSettings
from foveacam_pipeline.models.calibration import Calibration, eye_volts
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8

KEPT = 60
"""Pictures held at once: as many as the views of one point and of the next look at."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StopPose:
    """Where the rig stood at a stop, as seen from the judged scan's rig frame.

    `place_m`: (3,); `turn`: (3, 3) from this stop's rig frame; `shifts_px`: (2, 2) of the left and of the
    right eye: what its gazes were off by.
    """

    place_m: Floats
    turn: Floats
    shifts_px: Floats

    @classmethod
    def told(cls, stop: RailStop) -> "StopPose":
        """Return what the rail said."""
        return cls(place_m=np.array([stop.along_m, 0.0, 0.0]), turn=np.eye(3), shifts_px=np.zeros((2, 2)))

    def own(self, points_m: Floats) -> Floats:
        """Return (..., 3) points of the judged scan's rig frame in this stop's."""
        return np.asarray((points_m - self.place_m) @ self.turn, dtype=np.float64)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FoveaView:
    """One fovea of one point. `stop`: by its number among the stops; `eye`: 0 left, 1 right."""

    number: int
    point: DatasetPoint
    stop: int
    eye: int
    look: EyeLook

    @property
    def role(self) -> Role:
        """Whose it is."""
        return EYES[self.eye]


def sights_of(
    dataset: Dataset, stops: tuple[RailStop, ...], calibration: Calibration, settings: ReferenceSettings
) -> list[FoveaView]:
    """Return the foveae of all stops; points without a frame or its volts are passed over."""
    numbers = {stop.scan: number for number, stop in enumerate(stops)}
    found: list[FoveaView] = []
    for point in dataset:
        volts = point.pose.volts
        if volts is None or point.place.scan not in numbers:
            continue
        for eye, role in enumerate(EYES):
            if any(frame.role is role and frame.bracket == settings.bracket for frame in point.frames):
                look = EyeLook.of(calibration, role, eye_volts(volts, role))
                stop = numbers[point.place.scan]
                found.append(FoveaView(number=len(found), point=point, stop=stop, eye=eye, look=look))
    return found


class GreyPictureCache:
    """Reads grey pictures when asked, whole or made smaller by a whole factor, and keeps the latest."""

    def __init__(self, bracket: int) -> None:
        self._bracket = bracket
        self._kept: OrderedDict[tuple[int, int], NDArray[np.uint8]] = OrderedDict()

    def of(self, sight: FoveaView, factor: int = 1) -> NDArray[np.uint8]:
        """Return (h, w) uint8. Raise InvalidInput for a frame that is gone or damaged."""
        key = sight.number, factor
        if key not in self._kept:
            whole = gray(to_uint8(sight.point.stacked(sight.role, bracket=self._bracket)))
            self._kept[key] = whole if factor == 1 else _smaller(whole, factor)
            if len(self._kept) > KEPT:
                self._kept.popitem(last=False)
        self._kept.move_to_end(key)
        return self._kept[key]


def _smaller(image: NDArray[np.uint8], factor: int) -> NDArray[np.uint8]:
    height, width = (size // factor for size in image.shape)
    even = image[: factor * height, : factor * width]
    return np.asarray(cv2.resize(even, (width, height), interpolation=cv2.INTER_AREA), dtype=np.uint8)
