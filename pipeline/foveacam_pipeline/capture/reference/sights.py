"""The stops of the rail, and every fovea of every scan: where it stood, where it looked, its picture."""

from collections import OrderedDict
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput, NotCalibrated, Role
from foveacam_pipeline.capture.dataset.reader import Dataset, DatasetPoint
from foveacam_pipeline.capture.mosaic.look import EyeLook
from foveacam_pipeline.capture.reference.values import Floats, ReferenceSettings
from foveacam_pipeline.models.calibration import Calibration, eye_volts
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8

EYES = (Role.LEFT, Role.RIGHT)
LEAST_APART_M = 0.01
"""Scans nearer to each other than this are of one place."""
KEPT = 60
"""Pictures held at once: as many as the views of one point and of the next look at."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Stop:
    """A scan's place on the rail; `along_m`: from the judged scan's, as the rail said."""

    scan: int
    rail_m: float
    along_m: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stand:
    """Where the rig stood at a stop, as seen from the judged scan's rig frame.

    `place_m`: (3,); `turn`: (3, 3) from this stop's rig frame; `shifts_px`: (2, 2) of the left and of the
    right eye: what its gazes were off by.
    """

    place_m: Floats
    turn: Floats
    shifts_px: Floats

    @classmethod
    def told(cls, stop: Stop) -> "Stand":
        """Return what the rail said."""
        return cls(place_m=np.array([stop.along_m, 0.0, 0.0]), turn=np.eye(3), shifts_px=np.zeros((2, 2)))

    def own(self, points_m: Floats) -> Floats:
        """Return (..., 3) points of the judged scan's rig frame in this stop's."""
        return np.asarray((points_m - self.place_m) @ self.turn, dtype=np.float64)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sight:
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


def calibration_of(dataset: Dataset) -> Calibration:
    """Return the dataset's calibration or refuse."""
    if dataset.calibration is None:
        raise NotCalibrated(
            f"{dataset.folder} has no calibration: where its views look is not known; capture with one"
        )
    bearings = {(point.place.pan_rad, point.place.tilt_rad) for point in dataset}
    if len(bearings) > 1:
        raise InvalidInput(
            f"{dataset.folder} was taken from {len(bearings)} bearings of the pan-tilt, whose axes are not "
            "calibrated; a reference needs scans that differ by the rail alone"
        )
    return dataset.calibration


def stops_of(dataset: Dataset, settings: ReferenceSettings) -> tuple[tuple[Stop, ...], int]:
    """Return the stops and which of them is judged; refuse a dataset of one place."""
    places = {number: _rail_m(dataset, number) for number in dataset.scans}
    known = {number: rail_m for number, rail_m in places.items() if rail_m is not None}
    spread_m = max(known.values(), default=0.0) - min(known.values(), default=0.0)
    if spread_m < LEAST_APART_M:
        raise InvalidInput(
            f"{dataset.folder}: a reference was asked for, which needs scans from two places on the rail or "
            f"more; {_found(known)}; capture with several rail positions",
            asked="scans from two places on the rail or more",
            found=_found(known),
            remedy="capture with several rail positions",
        )
    chosen = settings.scan
    if chosen is None:
        middle_m = (max(known.values()) + min(known.values())) / 2.0
        chosen = min(known, key=lambda number: abs(known[number] - middle_m))
    if chosen not in known:
        raise InvalidInput(
            f"{dataset.folder} has no scan {chosen} on the rail; its scans are {sorted(known)}"
        )
    stops = tuple(
        Stop(scan=number, rail_m=rail_m, along_m=rail_m - known[chosen]) for number, rail_m in known.items()
    )
    return stops, list(known).index(chosen)


def sights_of(
    dataset: Dataset, stops: tuple[Stop, ...], calibration: Calibration, settings: ReferenceSettings
) -> list[Sight]:
    """Return the foveae of all stops; points without a frame or its volts are passed over."""
    numbers = {stop.scan: number for number, stop in enumerate(stops)}
    found: list[Sight] = []
    for point in dataset:
        volts = point.pose.volts
        if volts is None or point.place.scan not in numbers:
            continue
        for eye, role in enumerate(EYES):
            if any(kept.role is role and kept.bracket == settings.bracket for kept in point.frames):
                look = EyeLook.of(calibration, role, eye_volts(volts, role))
                stop = numbers[point.place.scan]
                found.append(Sight(number=len(found), point=point, stop=stop, eye=eye, look=look))
    return found


class Pictures:
    """Reads grey pictures when asked, whole or made smaller by a whole factor, and keeps the latest."""

    def __init__(self, bracket: int) -> None:
        self._bracket = bracket
        self._kept: OrderedDict[tuple[int, int], NDArray[np.uint8]] = OrderedDict()

    def of(self, sight: Sight, factor: int = 1) -> NDArray[np.uint8]:
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


def _rail_m(dataset: Dataset, scan: int) -> float | None:
    """Return where a scan stood on the rail; None where that is not known or changed by itself."""
    said = [point.place.rail_m for point in dataset.scan(scan)]
    known = [rail_m for rail_m in said if rail_m is not None]
    if not known or len(known) < len(said) or max(known) - min(known) > LEAST_APART_M / 10.0:
        return None
    return float(np.median(known))


def _found(known: dict[int, float]) -> str:
    if not known:
        return "it does not say where on a rail any scan was taken"
    places = ", ".join(f"{1e3 * rail_m:g} mm" for rail_m in sorted(set(known.values())))
    return f"it has {len(known)} scan{'s' if len(known) > 1 else ''} from {places}"
