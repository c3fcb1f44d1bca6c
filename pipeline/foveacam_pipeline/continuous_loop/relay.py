"""Finds the gains of one axis by a relay: the command jumps to and fro by what the error says.

The height of the swing of the error and its period give the ultimate gain and period (Astrom and Hagglund,
1984); Tyreus and Luyben's rule (1992) makes gains of them that hardly overshoot.
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
"""Half of the jump; the next one is tried where the eyes do not answer the last."""
HYSTERESIS = 0.15
"""The relay turns over once the error is so far beyond 0, as a share of half the jump."""
CYCLES = 3
SPREAD = 0.35
"""Cycles may differ by so much of their mean."""
ANSWERS = 0.7
"""The swing must be so large, as a share of the jump: else the eyes do not answer it. Where one eye of two
is stuck it is a half."""
SILENT_LOOKS = 6
"""An axis that has not answered by then is tried with a wider jump."""
MOST_LOOKS = 40
MISSED_LOOKS = 3
"""Looks in a row in which the target was not found, as when somebody stands in front of it."""
WEAKEST_ULTIMATE_GAIN = 0.5
"""An axis that swings by more than its jump would account for this is disturbed, not answering."""


class TuneRefused(OutOfRange):
    """Tuning was ended before its time; the gains are as before."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RelayResult:
    """What a relay found of one axis. `period_looks`: of the swing; `ultimate_period`: loop time."""

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
    """Let one axis swing about where it is; the command is put back whatever happens.

    `step`: makes one look of the loop. Raise `TuneRefused` where the axis does not answer, where the target
    is not found, and where the swing is not regular.
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
        f"{axis.value} does not answer a jump of {math.degrees(AMPLITUDES_RAD[-1]):.1f} degrees; "
        "check that its mirror turns, and that the target has texture"
    )


def seen(done: LoopStep, misses: int) -> int:
    """Return the looks in a row that did not show the target; raise `TuneRefused` when they are too many."""
    if done.status is LoopStatus.TRACKING and done.errors is not None:
        return 0
    if done.status in {LoopStatus.LOW_SCORE, LoopStatus.TRACKER_LOST} and misses + 1 < MISSED_LOOKS:
        return misses + 1
    raise TuneRefused(
        f"the loop says {done.status.value.replace('_', ' ')}: tuning needs a target that both eyes reach "
        "and see all the time; choose one that stands still, with nobody in front of it"
    )


def _swing(
    loop: VergenceLoop, axis: Axis, step: Callable[[], LoopStep], middle_rad: float, amplitude_rad: float
) -> RelayResult | None:
    """Return what one amplitude shows; None where the axis does not answer it."""
    index, side, misses = AXES.index(axis), 1.0, 0
    errors: list[float] = []
    turns: list[int] = []
    times_ns: list[int] = []
    while len(errors) < MOST_LOOKS:
        loop.set_command(axis, middle_rad + side * amplitude_rad)
        done = step()
        misses = seen(done, misses)
        if done.errors is None:
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
        f"{axis.value} does not swing to and fro in {MOST_LOOKS} looks; something else moves the target"
    )


def _dt(loop: VergenceLoop, times_ns: list[int]) -> float:
    """Return loop time from look to look."""
    return loop_time(float(np.median(np.diff(times_ns))) / 1e9, loop.settings.sensitivity)


def _result(
    axis: Axis, amplitude_rad: float, errors: list[float], turns: list[int], dt: float
) -> RelayResult:
    """Reduce the full cycles; raise `TuneRefused` where they differ too much."""
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
        raise TuneRefused(f"{axis.value} swings more than its mirror turns: something else moves the target")
    return RelayResult(
        axis=axis,
        amplitude_rad=amplitude_rad,
        swing_rad=float(swings.mean()),
        period_looks=float(periods.mean()),
        ultimate_gain=ultimate_gain,
        ultimate_period=float(periods.mean()) * dt,
    )
