"""Relay-feedback tuning of one axis: the command switches between two values by the sign of the error.

Amplitude and period of the resulting limit cycle give the ultimate gain and period (Astrom and Hagglund,
1984), from which the rule of Tyreus and Luyben (1992) derives gains with little overshoot.
"""

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from foveacam_hardware.contract import OutOfRange
from foveacam_pipeline.continuous_loop.pid import loop_time
from foveacam_pipeline.continuous_loop.settings import AXES, MOST_GAIN, Axis, Gains
from foveacam_pipeline.continuous_loop.vergence_loop import LoopStatus, LoopStep, VergenceLoop

AMPLITUDES_RAD = tuple(math.radians(deg) for deg in (0.1, 0.2, 0.4))
"""Relay amplitudes (half the jump of the command); the next is tried if the axis does not respond."""
HYSTERESIS = 0.15
"""Hysteresis of the relay: it switches once the error exceeds this share of the relay amplitude."""
CYCLES = 3
"""Full cycles that are averaged."""
SPREAD = 0.35
"""Largest range of the cycles' periods or amplitudes, as a share of their mean."""
ANSWERS = 0.7
"""Least peak-to-peak error, as a share of the jump, for an axis to count as responding: it is a half when
one eye of two is stuck."""
SILENT_LOOKS = 6
"""Looks after which an axis that does not respond is tried with a larger amplitude."""
MOST_LOOKS = 40
MISSED_LOOKS = 3
"""Looks in a row without the target (as under occlusion) that end the tuning."""
MISSES = frozenset(
    {
        LoopStatus.LOW_SCORE,
        LoopStatus.TRACKER_LOST,
        LoopStatus.MATCH_STALE,
        LoopStatus.PAIR_SKEW,
        LoopStatus.TRIGGER_FAULT,
    }
)
"""Statuses of a look that missed the target: it is hidden, or a frame came late, as on a busy computer."""
WEAKEST_ULTIMATE_GAIN = 0.5
"""A smaller ultimate gain (an oscillation larger than the relay explains) means an external disturbance."""


class TuneRefused(OutOfRange):
    """Tuning was aborted; the gains are unchanged."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RelayResult:
    """Limit cycle of one axis. `period_looks`: its period; `ultimate_period`: the same in loop time."""

    axis: Axis
    amplitude_rad: float
    swing_rad: float
    period_looks: float
    ultimate_gain: float
    ultimate_period: float

    @property
    def gains(self) -> Gains:
        """Gains by the rule of Tyreus and Luyben."""
        kp = self.ultimate_gain / 2.2
        return Gains(
            kp=min(MOST_GAIN, kp),
            ki=min(MOST_GAIN, kp / (2.2 * self.ultimate_period)),
            kd=min(MOST_GAIN, kp * self.ultimate_period / 6.3),
        )


def relay(loop: VergenceLoop, axis: Axis, step: Callable[[], LoopStep]) -> RelayResult:
    """Drive one axis into a limit cycle about its command; the command is restored in any case.

    `step`: makes one look of the loop. Raise `TuneRefused` if the axis does not respond, if the target is
    not found, or if the limit cycle is irregular.
    """
    index = AXES.index(axis)
    middle_rad = float(loop.command_rad[index])
    loop.forced.add(axis)
    try:
        for amplitude_rad in AMPLITUDES_RAD:
            found = _swing(loop, axis, step, middle_rad, amplitude_rad)
            if found is not None:
                return found
    finally:
        loop.forced.discard(axis)
        loop.set_command(axis, middle_rad)
    raise TuneRefused(
        f"{axis.value} does not answer a relay amplitude of {math.degrees(AMPLITUDES_RAD[-1]):.1f} degrees; "
        "check that its mirror turns, and that the target has texture"
    )


def seen(done: LoopStep, misses: int) -> int:
    """Return the updated number of looks in a row that missed the target; raise `TuneRefused` at the limit.

    The errors of a look that missed it do not count.
    """
    if done.status is LoopStatus.TRACKING and done.errors is not None:
        return 0
    if done.status in MISSES and misses + 1 < MISSED_LOOKS:
        return misses + 1
    raise TuneRefused(
        f"the loop reports {done.status.value.replace('_', ' ')}: tuning needs a target that both eyes reach "
        "and see all the time; choose one that stands still and is never covered"
    )


def _swing(
    loop: VergenceLoop, axis: Axis, step: Callable[[], LoopStep], middle_rad: float, amplitude_rad: float
) -> RelayResult | None:
    """Return the limit cycle at one relay amplitude; None if the axis does not respond to it."""
    index, side, misses = AXES.index(axis), 1.0, 0
    errors: list[float] = []
    turns: list[int] = []
    times_ns: list[int] = []
    while len(errors) < MOST_LOOKS:
        loop.set_command(axis, middle_rad + side * amplitude_rad)
        done = step()
        misses = seen(done, misses)
        if misses or done.errors is None:
            continue
        errors.append(float(done.errors.values_rad[index]))
        times_ns.append(done.t_ns)
        wanted = math.copysign(1.0, errors[-1])
        if wanted != side and abs(errors[-1]) > HYSTERESIS * amplitude_rad:
            side = wanted
            if side > 0.0:
                turns.append(len(errors))
        if len(turns) > CYCLES:
            return _result(axis, amplitude_rad, errors, turns, _dt(loop, times_ns))
        if len(errors) >= SILENT_LOOKS and np.ptp(errors) < 2.0 * ANSWERS * amplitude_rad:
            return None
    raise TuneRefused(
        f"{axis.value} does not swing regularly within {MOST_LOOKS} looks; choose a target that stands still"
    )


def _dt(loop: VergenceLoop, times_ns: list[int]) -> float:
    """Return the median loop time between two looks."""
    return loop_time(float(np.median(np.diff(times_ns))) / 1e9, loop.settings.sensitivity)


def _result(
    axis: Axis, amplitude_rad: float, errors: list[float], turns: list[int], dt: float
) -> RelayResult:
    """Average the full cycles; raise `TuneRefused` if they differ by more than `SPREAD`."""
    cycles = [errors[first:last] for first, last in itertools.pairwise(turns)]
    periods = np.array([len(cycle) for cycle in cycles], dtype=np.float64)
    swings = np.array([np.ptp(cycle) / 2.0 for cycle in cycles])
    for name, values in (("period", periods), ("height", swings)):
        if float(np.ptp(values)) > SPREAD * float(values.mean()):
            raise TuneRefused(
                f"{axis.value} swings irregularly ({name} {values.min():.3g} to {values.max():.3g}); "
                "choose a target that stands still"
            )
    ultimate_gain = 4.0 * amplitude_rad / (math.pi * float(swings.mean()))
    if ultimate_gain < WEAKEST_ULTIMATE_GAIN:
        raise TuneRefused(
            f"{axis.value} swings more than its mirror turns: the target moves; choose one that stands still"
        )
    return RelayResult(
        axis=axis,
        amplitude_rad=amplitude_rad,
        swing_rad=float(swings.mean()),
        period_looks=float(periods.mean()),
        ultimate_gain=ultimate_gain,
        ultimate_period=float(periods.mean()) * dt,
    )
