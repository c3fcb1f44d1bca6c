"""What a characterisation of the mirrors' settling is asked for, and what it found."""

import math
from dataclasses import dataclass

import numpy as np

from foveacam_hardware.contract import PARKED, MirrorVolts, Role, StereoVolts

NOISE_SIGMAS = 3.0
"""What is below so many standard deviations of a place at rest cannot be told from rest."""
DECAY_RATIO = 8.0
HALF = 0.5
AXES = ("x", "y")


@dataclass(frozen=True, slots=True, kw_only=True)
class SettleSettings:
    """How the mirrors are stepped and watched."""

    step_v: float = 17.0
    """About a degree."""
    centre: StereoVolts = PARKED
    """The steps go to and fro about this; something textured that stands still must be in view there."""
    axes: tuple[str, ...] = AXES
    """Which axes are measured, both eyes at once."""
    exposure_ns: int = 50_000
    gain_db: float = 24.0
    """Short, so that a picture shows a moment; bright enough to be measured."""
    settled_us: int = 60_000
    """After so long every mirror is at rest."""
    longest_us: int = 40_000
    """Nothing is expected to move any more after this."""
    delays: int = 36
    """How many delays between the step and the picture, up to when nothing moves."""
    wide_open_hz: int = 1000
    """Cut-off of the drive filter with which the mirror itself is made to ring."""
    ringing_us: int = 9_000
    ringing_delays: int = 44
    limit_px: float = 1.0
    limit_share: float = 0.01


@dataclass(frozen=True, slots=True, kw_only=True)
class MirrorResonance:
    """A mirror's own swing after a step: frequency, quality, and their standard errors."""

    frequency_hz: float
    quality: float
    frequency_sigma_hz: float
    quality_sigma: float


@dataclass(frozen=True, slots=True, kw_only=True)
class StepTrace:
    """What one axis did after a step.

    `times_us`: from the command to the middle of the exposure. `left_px`: distance from rest along the step.
    `unrecognised`: how many pictures are left out because nobody knows what they show.
    """

    times_us: tuple[float, ...]
    left_px: tuple[float, ...]
    unrecognised: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisSettle:
    """One axis of one eye.

    `step_px`: how far the picture moved, with the sign of its motion along the step. `noise_px`: standard
    deviation of a measured place at rest. `settle_us`, `settle_share_us`: when it was within `limit_px`, and
    within `limit_share` of the step, for good. `resonance`: None where the data do not show one; `ringing`
    says why.
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
        """When half of the step was done for the first time."""
        return _first_half_us(self.trace, self.step_px)

    @property
    def response_open_us(self) -> float:
        """The same with the drive filter wide open: nearly the mirror alone."""
        return _first_half_us(self.open_trace, self.step_px)

    def settle_for_us(self, step_px: float, *, within_px: float = 1.0) -> float:
        """Return when a step of `step_px` is within `within_px` of rest: every step is this one, scaled."""
        return time_below(self.trace, abs(self.step_px) * within_px / abs(step_px), floor_px=self.noise_px)


@dataclass(frozen=True, slots=True, kw_only=True)
class SettleReport:
    """All four axes, and with what they were measured."""

    rig_id: str
    created_utc: str
    low_pass_hz: int | None
    """Cut-off of the drive filter in normal use; None when the rig does not say."""
    exposure_us: float
    limit_px: float
    limit_share: float
    axes: tuple[AxisSettle, ...]

    def axis(self, role: Role, axis: str) -> AxisSettle:
        """Return one axis of one eye."""
        return next(found for found in self.axes if found.role is role and found.axis == axis)

    @property
    def settle_us(self) -> float:
        """Return when the slowest axis was within `limit_px`."""
        return max(found.settle_us for found in self.axes)

    def settle_for_us(self, step_px: float, *, within_px: float = 1.0) -> float:
        """Return how long to wait after a step of `step_px` in any direction: for a raster, for a trigger."""
        return max(found.settle_for_us(step_px, within_px=within_px) for found in self.axes)


def _first_half_us(trace: StepTrace, step_px: float) -> float:
    """Return when a trace first came below half of its step, µs; straight lines between its pictures."""
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
    """Return when a trace was below a limit for good, µs.

    Between two pictures it falls as fast as from one to the next; below what can be measured, or after the
    last picture, as fast as it fell before.
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
    """Return (µs, px): the most that is still to come at each time; it never rises."""
    most, envelope = 0.0, []
    for t_us, left_px in sorted(zip(trace.times_us, trace.left_px, strict=True), reverse=True):
        most = max(most, abs(left_px))
        envelope.append((t_us, most))
    return envelope[::-1]


def _extrapolated_us(envelope: list[tuple[float, float]], limit_px: float, *, floor_px: float) -> float:
    """Return when a limit is reached that was not seen, at the rate of the last decade above the noise."""
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
    """Return volts with one axis of both mirrors moved."""

    def one(mirror: MirrorVolts) -> MirrorVolts:
        if axis == "x":
            return MirrorVolts(x_v=mirror.x_v + by_v, y_v=mirror.y_v)
        return MirrorVolts(x_v=mirror.x_v, y_v=mirror.y_v + by_v)

    return StereoVolts(left=one(volts.left), right=one(volts.right))
