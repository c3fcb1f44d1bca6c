"""Turns the loop's looks, history and tuning into REST's schemas."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.continuous_loop.autotune import TuneResult
from foveacam_pipeline.continuous_loop.settings import AXES
from foveacam_pipeline.continuous_loop.split_eyes import SplitStep
from foveacam_pipeline.continuous_loop.vergence_loop import LoopStep, VergenceLoop
from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.resources.looking.loop.schema import (
    LoopAxisDocument,
    LoopEyeDocument,
    LoopRelayDocument,
    LoopSample,
    LoopStatusName,
    LoopStepDocument,
    LoopTargetDocument,
    LoopTriggerDocument,
    LoopTuneDocument,
)
from foveacam_server.resources.looking.loop.settings_file import describe_settings

TUNE_PICTURE_URL = "/api/v1/loop/tune.png"
DETAILS: dict[LoopStatusName, str] = {
    "low_score": "One eye does not find the target: choose something with texture, enlarge the strip, or "
    "lower the least score.",
    "match_stale": "The wide view is too old: see whether its camera runs.",
    "pair_skew": "The foveae were exposed at different times: see their triggers.",
    "tracker_lost": "The tracker does not find the target; it goes on when it is seen again.",
    "out_of_reach": "The mirrors cannot turn there; the eyes look as near to it as they can.",
    "frozen": "The time for correcting is over; choose the target again, or correct for longer.",
    "waiting": "Another job has the rig; the loop goes on afterwards.",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class TunedLoop:
    """A successful tuning, and when it ended."""

    result: TuneResult
    tuned_utc: str


def describe_axes(
    command_rad: NDArray[np.float64],
    limits_rad: tuple[NDArray[np.float64], NDArray[np.float64]],
    errors_rad: NDArray[np.float64] | None,
    held: frozenset[str],
) -> list[LoopAxisDocument]:
    """Return all axes with their commands, ranges and errors; `held`: names of the held axes."""
    least, most = limits_rad
    return [
        LoopAxisDocument(
            axis=axis.value,
            command_deg=_deg(command_rad[index]),
            error_deg=None if errors_rad is None else _deg(errors_rad[index]),
            least_deg=_deg(least[index]),
            most_deg=_deg(most[index]),
            held=axis.value in held,
        )
        for index, axis in enumerate(AXES)
    ]


def describe_target(loop: VergenceLoop, t_ns: int) -> LoopTargetDocument | None:
    """Return the target's place and state at a time; None before one was chosen."""
    guide = loop.guide
    if guide is None:
        return None
    x_px, y_px = guide.pixel(t_ns)
    return LoopTargetDocument(
        x_px=round(x_px, 1), y_px=round(y_px, 1), state=guide.state.value, tracker_score=guide.score
    )


def describe_eyes(step: SplitStep | None) -> list[LoopEyeDocument]:
    """Return both eyes while each follows a separate place."""
    if step is None:
        return []
    return [
        LoopEyeDocument(
            eye="left" if role is Role.LEFT else "right",
            state=reading.state.value,
            x_px=None if reading.pixel is None else round(reading.pixel[0], 1),
            y_px=None if reading.pixel is None else round(reading.pixel[1], 1),
            score=reading.score,
        )
        for role, reading in step.readings.items()
    ]


def describe_trigger(loop: VergenceLoop | None, step: LoopStep | None) -> LoopTriggerDocument:
    """Return counts, failures and timing of the exposures."""
    gate = None if loop is None else loop.gate
    sighting = None if step is None else step.sighting
    after_ns = None if sighting is None else sighting.exposure_after_trigger_ns
    return LoopTriggerDocument(
        exposures=0 if gate is None else gate.exposures,
        failures=0 if gate is None else gate.failures,
        in_a_row=0 if gate is None else gate.in_a_row,
        latched=gate is not None and gate.latched,
        reason=None if gate is None else gate.reason,
        pair_skew_us=0.0 if step is None else step.pair_skew_ns / 1e3,
        after_trigger_us=None if after_ns is None else after_ns / 1e3,
        wide_age_ms=None if sighting is None else (sighting.wide.t_ns - sighting.left.t_ns) / 1e6,
    )


def sample_of(step: LoopStep, look: int, status: LoopStatusName) -> LoopSample:
    """Return one look of the history."""
    point = None if step.errors is None else step.errors.point
    return LoopSample(
        look=look,
        t_s=step.t_ns / 1e9,
        status=status,
        command_deg=_degs(step.command_rad),
        error_deg=None if step.errors is None else _degs(step.errors.values_rad),
        distance_m=None if point is None else point.distance_m,
        distance_sigma_m=None if point is None else point.distance_sigma_m,
        score=None if step.match is None else step.match.score,
    )


def describe_tuning(tuned: TunedLoop) -> LoopTuneDocument:
    """Return the document of a tuning."""
    result = tuned.result
    return LoopTuneDocument(
        tuned_utc=tuned.tuned_utc,
        settings=describe_settings(result.settings),
        relays=[
            LoopRelayDocument(
                axis=one.axis.value,
                amplitude_deg=_deg(one.amplitude_rad),
                swing_deg=_deg(one.swing_rad),
                period_looks=one.period_looks,
                ultimate_gain=one.ultimate_gain,
            )
            for one in result.relays
        ],
        steps=[
            LoopStepDocument(
                axis=axis.value,
                settle_before_ms=_ms(result.before[axis].settle_s),
                settle_ms=_ms(after.settle_s),
                overshoot_before=result.before[axis].overshoot,
                overshoot=after.overshoot,
            )
            for axis, after in result.after.items()
        ],
        cost_before=result.cost_before,
        cost_relay=result.cost_relay,
        cost=result.cost,
        candidates=result.candidates,
        picture_url=TUNE_PICTURE_URL,
    )


def first_limits_rad(calibration: Calibration | None) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the ranges of the axes before the loop runs; zeros without a calibration."""
    if calibration is None:
        return np.zeros(len(AXES)), np.zeros(len(AXES))
    return VergenceLoop.ranges_of(calibration)


def _deg(value_rad: float) -> float:
    return round(math.degrees(float(value_rad)), 5)


def _degs(values_rad: NDArray[np.float64]) -> tuple[float, float, float, float]:
    pan_x, pan_y, verge, shift_y = (_deg(value) for value in values_rad)
    return pan_x, pan_y, verge, shift_y


def _ms(value_s: float | None) -> float | None:
    return None if value_s is None else 1000.0 * value_s
