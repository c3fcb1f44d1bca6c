"""Check of the timing: the pictures of a step show when the eyes really exposed, and how fast the filter is.

The drive filter is the board's Bessel low-pass of the fifth order with a known cut-off. A filter of another
cut-off stretches the step in time; an exposure at another time than believed shifts it.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.accept.limits import AcceptanceLimits
from foveacam_pipeline.accept.rig_under_test import EYES, RigUnderTest
from foveacam_pipeline.accept.triggers import LineState
from foveacam_pipeline.accept.values import AcceptanceCheck, Fault, Measured, NamedFault, judged
from foveacam_pipeline.calibrate.settle.settle import characterise_settling
from foveacam_pipeline.calibrate.settle.settle_values import (
    AxisSettle,
    MirrorResonance,
    SettleReport,
    SettleSettings,
)
from foveacam_pipeline.calibrate.watcher import ProcedureWatcher

TITLE = "Timing: from the command to a settled picture"
FILTER_ORDER = 5
SCALES = np.geomspace(0.2, 2.0, 93)
FINE = 0.05


@dataclass(frozen=True, slots=True, kw_only=True)
class StepTiming:
    """What a traced step shows. `scale`: the filter's cut-off over the one that is set.

    `latency_ms`: from the trigger to the real exposure.
    """

    scale: float
    latency_ms: float


def check_timing(
    rig: RigUnderTest,
    limits: AcceptanceLimits,
    *,
    step: SettleSettings,
    lines: Mapping[Role, LineState],
    rig_id: str,
    begun_utc: str,
    watch: ProcedureWatcher,
) -> tuple[AcceptanceCheck, SettleReport]:
    """Return the result of steps of all four axes, and the traces that it is drawn from."""
    before = rig.settings()[Role.LEFT]
    report = characterise_settling(
        rig.access.head,
        clock=rig.clock,
        rig_id=rig_id,
        created_utc=begun_utc,
        watch=watch,
        settings=step,
        before=before,
    )
    strobe_ms = min((state.strobe_ms or 0.0 for state in lines.values()), default=0.0)
    timings = {
        (axis.role, axis.axis): step_timing(axis, cutoff_hz=report.low_pass_hz or 0, strobe_ms=strobe_ms)
        for axis in report.axes
    }
    findings = [*_slow_filter(timings, limits), *_late(timings, lines, limits)]
    return judged(
        "timing", TITLE, figures=_figures(report, timings, limits), findings=findings, picture="timing"
    ), report


def _figures(
    report: SettleReport, timings: Mapping[tuple[Role, str], StepTiming], limits: AcceptanceLimits
) -> list[Measured]:
    found = [
        Measured(
            name=f"{axis.role} {axis.axis}: settled to 1 px", value=round(axis.settle_us / 1e3, 2), unit="ms"
        )
        for axis in report.axes
    ]
    scale = float(np.median([timing.scale for timing in timings.values()]))
    found.append(
        Measured(
            name="drive filter: cut-off against the set one",
            value=round(scale, 3),
            unit="",
            low=1.0 - limits.filter_rel,
            high=1.0 + limits.filter_rel,
        )
    )
    found += [
        Measured(
            name=f"{role}: exposure after the trigger, by the pictures",
            value=round(_latency_ms(timings, role), 3),
            unit="ms",
            high=limits.strobe_after_trigger_ms,
        )
        for role in EYES
    ]
    return found


def _slow_filter(
    timings: Mapping[tuple[Role, str], StepTiming], limits: AcceptanceLimits
) -> list[NamedFault]:
    scale = float(np.median([timing.scale for timing in timings.values()]))
    if abs(scale - 1.0) <= limits.filter_rel:
        return []
    detail = f"the mirrors follow as behind a filter of {scale:.2f} times the cut-off that is set"
    return [NamedFault(fault=Fault.SLOW_FILTER, subject="", detail=detail)]


def _late(
    timings: Mapping[tuple[Role, str], StepTiming],
    lines: Mapping[Role, LineState],
    limits: AcceptanceLimits,
) -> list[NamedFault]:
    """Return the eyes whose exposure, or whose strobe, is late."""
    found = []
    for role, state in lines.items():
        if state.strobe_ms is None:
            continue
        shown_ms = _latency_ms(timings, role)
        if abs(shown_ms - state.strobe_ms) > limits.latency_differs_ms:
            fault = Fault.LATE_STROBE
            detail = (
                f"the {role} camera's strobe comes {state.strobe_ms:.2f} ms after the trigger, its pictures "
                f"show an exposure after {shown_ms:.2f} ms"
            )
        elif state.strobe_ms > limits.strobe_after_trigger_ms:
            fault = Fault.LATE_EXPOSURE
            detail = f"the {role} camera exposes {state.strobe_ms:.2f} ms after the trigger"
        else:
            continue
        found.append(NamedFault(fault=fault, subject=str(role), detail=detail))
    return found


def _latency_ms(timings: Mapping[tuple[Role, str], StepTiming], role: Role) -> float:
    return float(np.mean([timing.latency_ms for (eye, _), timing in timings.items() if eye is role]))


def step_timing(axis: AxisSettle, *, cutoff_hz: int, strobe_ms: float) -> StepTiming:
    """Return the filter's scale and the exposure's latency that explain the trace of a step best.

    `strobe_ms`: from the trigger to the first strobe, by which the trace's times were counted.
    """
    times_s = np.array(axis.trace.times_us) * 1e-6 - 1e-3 * strobe_ms
    left = np.array(axis.trace.left_px) / axis.step_px
    best, found = math.inf, StepTiming(scale=1.0, latency_ms=0.0)
    grid_s, response = filter_response(cutoff_hz, axis.resonance)
    latencies_s = np.arange(-0.5e-3, 4.0e-3, FINE * 1e-3)
    for scale in SCALES:
        # a filter of `scale` times the cut-off answers in 1 / scale of the time
        at = (times_s[None, :] + latencies_s[:, None]) * scale
        expected = 1.0 - np.interp(at, grid_s, response)
        errors = np.sum((expected - left) ** 2, axis=1)
        index = int(np.argmin(errors))
        if errors[index] < best:
            best = float(errors[index])
            found = StepTiming(scale=float(scale), latency_ms=1e3 * float(latencies_s[index]))
    return found


def filter_response(
    cutoff_hz: int, mode: MirrorResonance | None = None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return times (n,), s, and the step response (n,) of the drive filter and the mirror's own `mode`."""
    from scipy import signal  # takes a second to import

    numerator, denominator = signal.bessel(FILTER_ORDER, 2.0 * np.pi * cutoff_hz, analog=True, norm="mag")
    if mode is not None:
        omega = 2.0 * np.pi * mode.frequency_hz
        numerator = np.asarray(numerator * omega**2)
        denominator = np.convolve(denominator, [1.0, omega / mode.quality, omega**2])
    times_s = np.linspace(0.0, 8.0 / cutoff_hz, 4000)
    _, response = signal.step((numerator, denominator), T=times_s)
    return times_s, np.asarray(response, dtype=np.float64)
