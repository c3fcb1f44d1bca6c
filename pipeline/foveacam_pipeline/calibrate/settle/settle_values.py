"""Value types of a settling measurement: settings, traces and the report, with the settle times of traces."""

import math
from dataclasses import dataclass

import numpy as np

from foveacam_hardware.contract import PARKED, MirrorVolts, Role, StereoVolts

NOISE_SIGMAS = 3.0
"""Distances below this many standard deviations of a position at rest cannot be distinguished from rest."""
DECAY_RATIO = 8.0
HALF = 0.5
AXES = ("x", "y")


@dataclass(frozen=True, slots=True, kw_only=True)
class SettleSettings:
    """Settings of a settling measurement."""

    step_v: float = 17.0
    """About a degree."""
    centre: StereoVolts = PARKED
    """Centre of the steps; a textured, static scene must be in view there."""
    axes: tuple[str, ...] = AXES
    """The measured axes, both eyes at once."""
    exposure_ns: int = 50_000
    gain_db: float = 24.0
    """Short, so that a picture shows one moment, and bright enough to be measured."""
    settled_us: int = 60_000
    """Time after which every mirror is at rest."""
    longest_us: int = 40_000
    """Longest delay; no motion is expected after it."""
    delays: int = 36
    """Number of delays from the step until nothing moves."""
    wide_open_hz: int = 1000
    """Cut-off of the drive filter for the mirror's own ringing."""
    ringing_us: int = 9_000
    ringing_delays: int = 44
    limit_px: float = 1.0
    limit_share: float = 0.01


@dataclass(frozen=True, slots=True, kw_only=True)
class MirrorResonance:
    """Resonance of a mirror: frequency, quality, and their standard errors."""

    frequency_hz: float
    quality: float
    frequency_sigma_hz: float
    quality_sigma: float


@dataclass(frozen=True, slots=True, kw_only=True)
class StepTrace:
    """Motion of one axis after a step.

    `times_us`: from the command to the middle of the exposure. `left_px`: distance from rest along the step.
    `unrecognised`: number of pictures left out because they could not be matched.
    """

    times_us: tuple[float, ...]
    left_px: tuple[float, ...]
    unrecognised: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisSettle:
    """Settling of one axis of one eye.

    `step_px`: image motion of the step, with its sign. `noise_px`: standard deviation of a position at rest.
    `settle_us`, `settle_share_us`: times after which it stays within `limit_px`, and within `limit_share` of
    the step. `resonance`: None where the data do not show one; `ringing` describes it, or the reason.
    """

    role: Role
    axis: str
    step_v: float
    step_px: float
    noise_px: float
    settle_us: float
    settle_share_us: float
    resonance: MirrorResonance | None
    ringing: str
    trace: StepTrace
    open_trace: StepTrace

    @property
    def response_us(self) -> float:
        """Time until half of the step is done."""
        return _first_half_us(self.trace, self.step_px)

    @property
    def response_open_us(self) -> float:
        """The same with the drive filter wide open, nearly that of the mirror alone."""
        return _first_half_us(self.open_trace, self.step_px)

    def settle_for_us(self, step_px: float, *, within_px: float = 1.0) -> float:
        """Return when a step of `step_px`, this one scaled, stays within `within_px` of rest, µs."""
        return time_below(self.trace, abs(self.step_px) * within_px / abs(step_px), floor_px=self.noise_px)


@dataclass(frozen=True, slots=True, kw_only=True)
class SettleReport:
    """Settling of all four axes, and the settings of the measurement."""

    rig_id: str
    created_utc: str
    low_pass_hz: int | None
    """Cut-off of the drive filter in normal use; None when unknown."""
    exposure_us: float
    limit_px: float
    limit_share: float
    axes: tuple[AxisSettle, ...]

    @property
    def settle_us(self) -> float:
        """Time after which the slowest axis is within `limit_px`."""
        return max(found.settle_us for found in self.axes)


def _first_half_us(trace: StepTrace, step_px: float) -> float:
    """Return the time at which a trace first falls below half of its step, µs, by linear interpolation."""
    left = np.array(trace.left_px) / step_px
    times_us = np.array(trace.times_us)
    below = np.flatnonzero(left < HALF)
    if len(below) == 0:
        return math.inf
    first = int(below[0])
    if first == 0:
        return float(times_us[0])
    before, after = left[first - 1], left[first]
    share = (before - HALF) / (before - after)
    return float(times_us[first - 1] + share * (times_us[first] - times_us[first - 1]))


def time_below(trace: StepTrace, limit_px: float, *, floor_px: float) -> float:
    """Return the time after which a trace stays below a limit, µs.

    It is interpolated exponentially between pictures, and extrapolated at the former rate below the noise and
    after the last picture.
    """
    envelope = _envelope(trace)
    above = [point for point in envelope if point[1] > limit_px]
    after = envelope[len(above) :]
    if limit_px < NOISE_SIGMAS * floor_px or not after:
        return _extrapolated_us(envelope, limit_px, floor_px=NOISE_SIGMAS * floor_px)
    if not above:
        return after[0][0]
    (last_us, last_px), (next_us, next_px) = above[-1], after[0]
    share = math.log(last_px / limit_px) / math.log(last_px / max(next_px, 1e-3 * limit_px))
    return last_us + min(1.0, share) * (next_us - last_us)


def _envelope(trace: StepTrace) -> list[tuple[float, float]]:
    """Return (µs, px) with the largest distance from each time on; it never rises."""
    most, envelope = 0.0, []
    for t_us, left_px in sorted(zip(trace.times_us, trace.left_px, strict=True), reverse=True):
        most = max(most, abs(left_px))
        envelope.append((t_us, most))
    return envelope[::-1]


def _extrapolated_us(envelope: list[tuple[float, float]], limit_px: float, *, floor_px: float) -> float:
    """Return the time of an unmeasured limit, extrapolated at the last decay rate above the noise."""
    above = [point for point in envelope if point[1] > floor_px]
    if not above:
        return math.inf
    last_us, last_px = above[-1]
    decade = [point for point in above if point[1] >= DECAY_RATIO * last_px]
    first_us, first_px = decade[-1] if decade else above[0]
    if not first_px > last_px:
        return math.inf
    rate_per_us = math.log(first_px / last_px) / (last_us - first_us)
    return last_us + math.log(last_px / limit_px) / rate_per_us


def offset_volts(volts: StereoVolts, axis: str, by_v: float) -> StereoVolts:
    """Return volts with an offset along one axis of both mirrors."""

    def one(mirror: MirrorVolts) -> MirrorVolts:
        if axis == "x":
            return MirrorVolts(x_v=mirror.x_v + by_v, y_v=mirror.y_v)
        return MirrorVolts(x_v=mirror.x_v, y_v=mirror.y_v + by_v)

    return StereoVolts(left=one(volts.left), right=one(volts.right))
