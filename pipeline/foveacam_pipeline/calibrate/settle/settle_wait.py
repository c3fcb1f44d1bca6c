"""How long a rig shall wait after a move, from how its mirrors were seen to settle.

The measured step is about a degree; a rig also makes moves of twenty. Filter and mirror are linear, so that
a larger move takes as much longer as their poles say; the measurement sets where that begins.
"""

import math

import numpy as np

from foveacam_pipeline.calibrate.settle.settle_resonance import remaining_step, system_poles
from foveacam_pipeline.calibrate.settle.settle_values import AxisSettle, SettleReport

WAIT_STEP_US = 100.0
"""To whole tenths of a millisecond, upwards."""
MODEL_SPAN_US = 200_000.0
MODEL_STEP_US = 10.0


def settle_wait_us(report: SettleReport, *, max_v: float) -> int:
    """Return after how long the largest move, from -`max_v` to `max_v`, is within the limit on every axis."""
    longest_us = max(largest_move_us(report, axis, move_v=2.0 * max_v) for axis in report.axes)
    return round(WAIT_STEP_US * math.ceil(longest_us / WAIT_STEP_US))


def largest_move_us(report: SettleReport, axis: AxisSettle, *, move_v: float) -> float:
    """Return after how long a move of `move_v` along one axis is within the limit for good, µs.

    Never less than was measured for the smaller step.
    """
    move_px = abs(axis.step_px) * move_v / abs(axis.step_v)
    if report.low_pass_hz is None or move_px <= abs(axis.step_px):
        return max(axis.settle_us, axis.settle_for_us(max(move_px, abs(axis.step_px))))
    small_us, large_us = (
        _modelled_settle_us(report.low_pass_hz, axis, share=report.limit_px / px)
        for px in (abs(axis.step_px), move_px)
    )
    return axis.settle_us + max(0.0, large_us - small_us)


def _modelled_settle_us(low_pass_hz: int, axis: AxisSettle, *, share: float) -> float:
    """Return when filter and mirror leave less than a share of a step for good, µs."""
    times_us = np.arange(0.0, MODEL_SPAN_US, MODEL_STEP_US)
    left = np.abs(remaining_step(system_poles(float(low_pass_hz), axis.resonance), 1e-6 * times_us))
    above = np.flatnonzero(left > share)
    return float(times_us[above[-1]]) if len(above) else 0.0
