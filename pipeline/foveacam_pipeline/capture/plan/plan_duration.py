"""The duration of a capture as a range, from the times of the rig's last captures; assumed without any.

`plan_estimate` has the least that physics allows; what fixations, the computer and the disk add is measured.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.capture.plan.plan_estimate import CaptureEstimate

LEAST, MOST = 0.75, 2.0
"""Share of a measured time that another capture takes. Deduced: of four on a shared computer of two cores,
the slowest took 2.1 times as long as the fastest."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TimeRange:
    """The least and the largest time that something is expected to take."""

    low_s: float
    high_s: float

    def __add__(self, other: "TimeRange") -> "TimeRange":
        return TimeRange(low_s=self.low_s + other.low_s, high_s=self.high_s + other.high_s)

    def times(self, count: int) -> "TimeRange":
        """Return the range of `count` such times."""
        return TimeRange(low_s=count * self.low_s, high_s=count * self.high_s)


ASSUMED_FIXATION = TimeRange(low_s=0.1, high_s=4.0)
"""Deduced: two looks of 50 ms; four times a fixation of the simulated rig on two cores, 1.0 s."""
ASSUMED_SHOT = TimeRange(low_s=0.0, high_s=0.6)
"""In addition to the physical limit. Deduced: four times a shot of the simulated rig on two cores, 0.15 s."""
ASSUMED_CLOSING = TimeRange(low_s=0.0, high_s=2.0)
NONE = TimeRange(low_s=0.0, high_s=0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class StepTimes:
    """Mean times of the steps of one capture. None: it had no such step.

    `shot_s`: of a shot of both foveae, in addition to its physical limit. `closing_s`: from the last point
    until everything was on the disk.
    """

    fixation_s: float | None
    shot_s: float | None
    closing_s: float | None

    def __post_init__(self) -> None:
        times_s = (self.fixation_s, self.shot_s, self.closing_s)
        if not all(time_s is None or 0.0 <= time_s < math.inf for time_s in times_s):
            raise InvalidInput(f"times of a capture: {self} cannot be; remove the file that has them")


@dataclass(frozen=True, slots=True, kw_only=True)
class CaptureDuration:
    """The duration of a capture until it is complete, without moves by hand.

    `preparing`: its part before the first point. `captures`: how many captures it was computed from; 0: it is
    assumed.
    """

    total: TimeRange
    preparing: TimeRange
    captures: int


def capture_duration(
    needed: CaptureEstimate, runs: Sequence[StepTimes], *, fixations: int, preparing: int | None = None
) -> CaptureDuration:
    """Return the duration of a plan with its estimate, from the times of earlier captures of the rig.

    `fixations`: of the whole capture; `preparing`: those before the first point, None for all.
    """
    fixation = _expected([run.fixation_s for run in runs], ASSUMED_FIXATION)
    shot = _expected([run.shot_s for run in runs], ASSUMED_SHOT)
    closing = _expected([run.closing_s for run in runs], ASSUMED_CLOSING)
    always = TimeRange(low_s=needed.limit_s + needed.rail_s, high_s=needed.limit_s + needed.rail_s)
    return CaptureDuration(
        total=always + fixation.times(fixations) + shot.times(needed.shots) + closing,
        preparing=fixation.times(fixations if preparing is None else preparing),
        captures=sum(run.closing_s is not None for run in runs),
    )


def _expected(times_s: Sequence[float | None], assumed: TimeRange) -> TimeRange:
    measured_s = [time_s for time_s in times_s if time_s is not None]
    if not measured_s:
        return assumed
    return TimeRange(low_s=LEAST * min(measured_s), high_s=MOST * max(measured_s))
