"""Independent visual servoing of each eye: it keeps a chosen point of its own image centred.

Each eye correlates its image at half size with a template about the chosen point. Neither the wide view nor
the other eye is used, so that the eyes can follow two different objects.
"""

import math
from dataclasses import dataclass
from enum import StrEnum

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Clock, Frame, Head, MirrorVolts, Role, Sighting, StereoVolts
from foveacam_pipeline.continuous_loop.pid import Pid, loop_time
from foveacam_pipeline.continuous_loop.settings import Gains
from foveacam_pipeline.models.calibration import Calibration, eye_volts
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import plane_from_raw, to_uint8
from foveacam_pipeline.track.image_tracker import GreyImage, TrackBox
from foveacam_pipeline.track.template_tracker import TemplateTracker
from foveacam_pipeline.verge.aim import EYES, Gazes, gazes_under, nearest_reachable, volts_for

TILE_PX = 512
"""Side of an eye's template, fovea px; smaller for a point near the image border."""
LEAST_TILE_PX = 96
REDUCTION = 2
LOST_MISSES = 5
MOST_STEP_V = 5.0
"""Largest change of a mirror's voltage between two looks, each axis: 0.3 degrees."""


class EyeState(StrEnum):
    """State of one eye's servo."""

    STILL = "still"
    """No point is chosen; the eye does not move."""
    TRACKING = "tracking"
    LOST = "lost"
    """The point is no longer found; the eye does not move until it is found again."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EyeReading:
    """One eye in one look: position of the point in its image, fovea px, and the correlation."""

    state: EyeState
    pixel: tuple[float, float] | None = None
    score: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SplitStep:
    """One look of both eyes, controlled independently."""

    t_ns: int
    sighting: Sighting
    readings: dict[Role, EyeReading]


class SplitEyes:
    """Keeps a chosen point of each fovea centred; an eye without one stays. For use by one thread."""

    def __init__(self, calibration: Calibration, *, clock: Clock) -> None:
        self._calibration = calibration
        self._clock = clock
        self._servos: dict[Role, _EyeServo] = {}
        self._volts: StereoVolts | None = None
        self._last_ns = 0

    def choose(self, role: Role, frame: Frame, pixel: tuple[float, float], volts: StereoVolts) -> None:
        """Keep a pixel of one eye's frame centred from now on; `volts`: those of that frame.

        Raise `OutOfRange` for a point without texture; the eye then continues as before.
        """
        servo = _EyeServo(self._calibration, role, frame, pixel)
        self._servos[role] = servo
        self._volts = self._volts or volts

    def step(self, head: Head, *, gains: Gains, sensitivity: float) -> SplitStep:
        """Look once and correct each eye; `gains` have the units of the pan loop's."""
        if self._volts is None:
            raise ValueError("step: choose a place first")
        sighting = head.look(self._volts)
        t_ns = sighting.left.t_ns
        dt = loop_time((t_ns - self._last_ns) / 1e9 if self._last_ns else 0.0, sensitivity)
        self._last_ns = t_ns
        gazes, readings = gazes_under(self._calibration, self._volts), {}
        turned = {}
        for role in EYES:
            servo = self._servos.get(role)
            if servo is None:
                turned[role], readings[role] = gazes.eye(role), EyeReading(state=EyeState.STILL)
            else:
                change, readings[role] = servo.see(sighting, dt=dt, gains=gains)
                turned[role] = nearest_reachable(self._calibration, role, gazes.eye(role) + change)
        wanted = volts_for(self._calibration, Gazes(left=turned[Role.LEFT], right=turned[Role.RIGHT]))
        self._volts = StereoVolts(
            left=_stepped(eye_volts(self._volts, Role.LEFT), wanted.left),
            right=_stepped(eye_volts(self._volts, Role.RIGHT), wanted.right),
        )
        return SplitStep(t_ns=t_ns, sighting=sighting, readings=readings)


class _EyeServo:
    """Servo of one eye on its template."""

    def __init__(
        self, calibration: Calibration, role: Role, frame: Frame, pixel: tuple[float, float]
    ) -> None:
        self._calibration = calibration
        self._role = role
        self._pids = (Pid(), Pid())
        self._tracker = TemplateTracker()
        width, height = calibration.fovea_width, calibration.fovea_height
        to_rim_px = min(pixel[0], pixel[1], width - 1 - pixel[0], height - 1 - pixel[1])
        side_px = max(LEAST_TILE_PX, min(TILE_PX, round(2.0 * to_rim_px) - 2 * REDUCTION)) // REDUCTION
        x_px, y_px = (_reduced(value) for value in pixel)
        box = TrackBox(x_px=x_px, y_px=y_px, width_px=side_px, height_px=side_px)
        self._tracker.start(_small(frame), box)

    def see(self, sighting: Sighting, *, dt: float, gains: Gains) -> tuple[NDArray[np.float64], EyeReading]:
        """Return the correction of the gaze, (2,) tangents, and the eye's reading."""
        frame = sighting.left if self._role is Role.LEFT else sighting.right
        match = self._tracker.update(_small(frame), None)
        if match is None:
            lost = self._tracker.misses >= LOST_MISSES
            return np.zeros(2), EyeReading(state=EyeState.LOST if lost else EyeState.TRACKING)
        pixel = (_enlarged(match.x_px), _enlarged(match.y_px))
        error = self._off_middle(sighting, pixel)
        change = [
            pid.change_rad(float(part), -float(part), dt=dt, gains=gains)
            for pid, part in zip(self._pids, error, strict=True)
        ]
        return np.array(change), EyeReading(state=EyeState.TRACKING, pixel=pixel, score=match.score)

    def _off_middle(self, sighting: Sighting, pixel: tuple[float, float]) -> NDArray[np.float64]:
        """Return the direction of a pixel relative to that of the image centre, (2,) tangents."""
        plane = plane_from_raw(self._calibration, self._role, sighting.volts, depth_m=math.inf)
        width, height = self._calibration.fovea_width, self._calibration.fovea_height
        raw = np.array([[pixel[0], pixel[1], 1.0], [(width - 1) / 2, (height - 1) / 2, 1.0]])
        there, middle = (plane @ one for one in raw)
        return np.asarray((there[:2] / there[2] - middle[:2] / middle[2]) / self._calibration.fovea_f_px)


def _stepped(before: MirrorVolts, wanted: MirrorVolts) -> MirrorVolts:
    """Return the wanted volts, limited to `MOST_STEP_V` from those before."""
    x_v, y_v = (
        float(np.clip(to, at - MOST_STEP_V, at + MOST_STEP_V))
        for at, to in ((before.x_v, wanted.x_v), (before.y_v, wanted.y_v))
    )
    return MirrorVolts(x_v=x_v, y_v=y_v)


def _small(frame: Frame) -> GreyImage:
    """Return the image in grey at half the sensor's resolution; a frame binned by 2 is not reduced."""
    picture, reduction = gray(to_uint8(frame)), REDUCTION // frame.binning
    height, width = picture.shape
    size = (width // reduction, height // reduction)
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _reduced(value_px: float) -> float:
    return (value_px - (REDUCTION - 1) / 2) / REDUCTION


def _enlarged(value_px: float) -> float:
    return REDUCTION * value_px + (REDUCTION - 1) / 2
