"""PID control that centres one eye's marker in its image.

The controller works in volts on the image error, in velocity form: it has no integral state besides its
command, so clamping the command at the limit also prevents windup. It succeeds when the marker's middle is
within `centred_px` of the image's centre on both axes (centred), or when an axis at its limit needs more
volts, with the whole marker in view (rim).
"""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.sweep.eye_prediction import LOCATED_SIGMA_V, EyePrediction, clamp_volts
from foveacam_pipeline.calibrate.sweep.marker_observation import (
    EyeObservation,
    MarkerLimits,
    rejection_reason,
)
from foveacam_pipeline.calibrate.sweep.sweep import EyePose

BEYOND = "beyond the volts"
"""First words of the reason that refuses a gaze beyond the allowed volts; callers recognise it by them."""
SMALLER = "choose a smaller sweep"
LIMIT_RINGS = 4
"""Number of search positions about a gaze that needs more volts than are allowed."""
LIMIT_TOLERANCE_V = 0.02
"""Tolerance of an axis at its limit: a few steps of the DAC."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CentringSettings:
    """Gains and limits. `proportional`, `integral`, `derivative`: shares of the error corrected in a look.

    `centred_px`: end condition on each axis, fovea px. `most_looks`: at one pose, search included.
    `ring_rad`: spacing of the search positions.
    """

    proportional: float = 0.05
    integral: float = 0.95
    derivative: float = 0.0
    centred_px: float = 12.0
    most_looks: int = 16
    most_doubtful: int = 3
    ring_rad: float = math.radians(0.7)
    limits: MarkerLimits = field(default_factory=MarkerLimits)


class TwoAxisPid:
    """Velocity-form PID of two axes (see the module's docstring)."""

    def __init__(self, settings: CentringSettings, *, max_v: float) -> None:
        self._settings = settings
        self._max_v = max_v
        self._errors: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None

    def next(self, command_v: NDArray[np.float64], error_v: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the command, (2,) V, after `command_v`, under which `error_v` was measured."""
        before, earlier = self._errors or (error_v, error_v)
        s = self._settings
        change = (
            s.proportional * (error_v - before)
            + s.integral * error_v
            + s.derivative * (error_v - 2.0 * before + earlier)
        )
        self._errors = (error_v, before)
        return clamp_volts(command_v + change, self._max_v)

    def restart(self) -> None:
        """Clear the errors, because the marker was lost."""
        self._errors = None


class EyeCentring:
    """Centring of one eye at one pose: each observation gives the next command, until it is `done`."""

    def __init__(
        self,
        role: Role,
        wanted_rad: NDArray[np.float64],
        prediction: EyePrediction,
        settings: CentringSettings,
        *,
        max_v: float,
    ) -> None:
        self.role = role
        self.result: EyePose | None = None
        self.refusal: str | None = None
        self.looks = 0
        self._wanted_rad = wanted_rad
        self._prediction = prediction
        self._settings = settings
        self._max_v = max_v
        self._pid = TwoAxisPid(settings, max_v=max_v)
        self._doubtful = 0
        self._rings = 0
        prediction.drop_provisional()
        self.command_v = clamp_volts(prediction.volts(wanted_rad), max_v)

    @property
    def done(self) -> bool:
        """Whether it ended, with a result or a refusal."""
        return self.result is not None or self.refusal is not None

    def refuse(self, reason: str) -> None:
        """End without a result."""
        self.refusal = reason

    def add_observation(
        self,
        observation: EyeObservation,
        gaze_rad: NDArray[np.float64] | None,
        *,
        asked_ns: int,
    ) -> None:
        """Add the observation of a look. `gaze_rad`: (2,) gaze of the eye, None when unknown."""
        self.looks += 1
        reason = rejection_reason(observation, self._settings.limits, asked_ns=asked_ns)
        if observation.view is None:
            self._search(observation, gaze_rad, str(reason))
        elif gaze_rad is not None:
            self._prediction.learn(gaze_rad, observation.volts_v)
            self._centre(observation, gaze_rad, reason)
        if not self.done and self.looks >= self._settings.most_looks:
            self.refuse(f"not centred after {self.looks} looks: {reason or self._off_centre(observation)}")

    def _centre(self, observation: EyeObservation, gaze_rad: NDArray[np.float64], reason: str | None) -> None:
        """Steer by a marker in view; end when it is centred, or cannot be centred."""
        slope = self._prediction.slope(gaze_rad)
        error_rad = self._wanted_rad - gaze_rad
        error_v = slope @ error_rad
        offset_px = observation.offset_px
        rad_per_px = math.hypot(*error_rad) / max(math.hypot(*offset_px), 1.0)
        tolerance_v = np.abs(np.diag(slope)) * self._settings.centred_px * rad_per_px
        centred = bool((np.abs(offset_px) <= self._settings.centred_px).all())
        beyond = self._axes_at_limit(observation.volts_v, error_v)
        command_v = self._pid.next(observation.volts_v, error_v)
        stays = np.abs(command_v - observation.volts_v).max() < LIMIT_TOLERANCE_V
        rim = bool(beyond.any() and (stays or (beyond | (np.abs(error_v) <= tolerance_v)).all()))
        if centred or rim:
            self._end(observation, reason, rim=not centred)
        else:
            self.command_v = command_v

    def _axes_at_limit(self, volts_v: NDArray[np.float64], error_v: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return the (2,) mask of the axes that are at their limit and need more volts."""
        at_limit = np.abs(volts_v) >= self._max_v - LIMIT_TOLERANCE_V
        return np.asarray(at_limit & (np.sign(error_v) == np.sign(volts_v)))

    def _end(self, observation: EyeObservation, reason: str | None, *, rim: bool) -> None:
        if reason is None and observation.view is not None:
            volts = (float(observation.volts_v[0]), float(observation.volts_v[1]))
            self.result = EyePose(
                volts_v=volts, corners=observation.view, centred=not rim, rim=rim, looks=self.looks
            )
            return
        self._doubtful += 1
        self.command_v = clamp_volts(observation.volts_v, self._max_v)  # as reported: rounded to codes
        if self._doubtful >= self._settings.most_doubtful:
            self.refuse(f"{self._needed_volts()}, and there {reason}; {SMALLER}" if rim else f"{reason}")

    def _search(self, observation: EyeObservation, gaze_rad: NDArray[np.float64] | None, reason: str) -> None:
        """Command the gaze that the wide view gives, or the next search position."""
        self._pid.restart()
        if gaze_rad is not None and observation.others:
            self._prediction.learn(gaze_rad, observation.volts_v)
        elif gaze_rad is not None and not self._prediction.add_provisional(gaze_rad, observation.volts_v):
            gaze_rad = None
        wanted_v = self._prediction.volts(self._wanted_rad)
        command_v = clamp_volts(wanted_v, self._max_v)
        moved = float(np.abs(command_v - observation.volts_v).max())
        there = moved < LOCATED_SIGMA_V and gaze_rad is not None
        if np.abs(wanted_v - command_v).max() > 0.0 and (there or self._rings >= LIMIT_RINGS):
            self.refuse(f"{self._needed_volts()}, and at the limit {reason}; {SMALLER}")
            return
        if gaze_rad is None or there:
            aside = _ring_offset(self._rings) * self._settings.ring_rad
            self._rings += 1
            command_v = clamp_volts(self._prediction.volts(self._wanted_rad + aside), self._max_v)
        self.command_v = command_v

    def _needed_volts(self) -> str:
        x, y = self._prediction.volts(self._wanted_rad).tolist()
        return f"{BEYOND}: the gaze would take ({x:.0f}, {y:.0f}) V, ±{self._max_v:g} V are allowed"

    def _off_centre(self, observation: EyeObservation) -> str:
        x, y = observation.offset_px.tolist()
        return f"the marker still is ({x:.0f}, {y:.0f}) px from the middle; check that the mirror follows"


def _ring_offset(number: int) -> NDArray[np.float64]:
    """Return the (2,) position of a number on square rings about the middle, nearest first."""
    x = y = 0
    dx, dy = 0, -1
    for _ in range(number + 1):
        if x == y or (x < 0 and x == -y) or (x > 0 and x == 1 - y):
            dx, dy = -dy, dx
        x, y = x + dx, y + dy
    return np.array([float(x), float(y)])
