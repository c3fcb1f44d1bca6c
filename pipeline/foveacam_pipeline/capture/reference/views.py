"""The fovea views of all scans on the rail: the pose of their stop, their projection, their pictures."""

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
from foveacam_pipeline.geometry.binning import enlarge
from foveacam_pipeline.models.calibration import Calibration, eye_volts
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8

CACHED_PICTURES = 60
"""Pictures in memory: as many as the matching of one point and of the next needs."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StopPose:
    """The pose of the rig at a stop, in the judged scan's rig frame.

    `position_m`: (3,); `turn`: (3, 3) from this stop's rig frame; `shifts_px`: (2, 2) errors of the gazes
    of the left and of the right eye.
    """

    position_m: Floats
    turn: Floats
    shifts_px: Floats

    @classmethod
    def from_rail(cls, stop: RailStop) -> "StopPose":
        """Return the pose that the rail reported."""
        return cls(position_m=np.array([stop.along_m, 0.0, 0.0]), turn=np.eye(3), shifts_px=np.zeros((2, 2)))

    def to_stop_frame(self, points_m: Floats) -> Floats:
        """Return (..., 3) points of the judged scan's rig frame in this stop's."""
        return np.asarray((points_m - self.position_m) @ self.turn, dtype=np.float64)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FoveaView:
    """One fovea of one point. `stop`: index of its stop; `eye`: 0 left, 1 right."""

    number: int
    point: DatasetPoint
    stop: int
    eye: int
    look: EyeLook

    @property
    def role(self) -> Role:
        """Its eye."""
        return EYES[self.eye]


def fovea_views(
    dataset: Dataset, stops: tuple[RailStop, ...], calibration: Calibration, settings: ReferenceSettings
) -> list[FoveaView]:
    """Return the foveae of all stops; points without a frame or its volts are skipped."""
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
    """Reads grey pictures on demand, at full size or reduced by an integer factor, and caches the latest."""

    def __init__(self, bracket: int) -> None:
        self._bracket = bracket
        self._cache: OrderedDict[tuple[int, int], NDArray[np.uint8]] = OrderedDict()

    def picture(self, view: FoveaView, factor: int = 1) -> NDArray[np.uint8]:
        """Return (h, w) uint8. Raise InvalidInput for a missing or damaged frame."""
        key = view.number, factor
        if key not in self._cache:
            frame = view.point.stacked(view.role, bracket=self._bracket)
            whole = enlarge(gray(to_uint8(frame)), binning=frame.binning)
            self._cache[key] = whole if factor == 1 else _downscale(whole, factor)
            if len(self._cache) > CACHED_PICTURES:
                self._cache.popitem(last=False)
        self._cache.move_to_end(key)
        return self._cache[key]


def _downscale(image: NDArray[np.uint8], factor: int) -> NDArray[np.uint8]:
    height, width = (size // factor for size in image.shape)
    even = image[: factor * height, : factor * width]
    return np.asarray(cv2.resize(even, (width, height), interpolation=cv2.INTER_AREA), dtype=np.uint8)
