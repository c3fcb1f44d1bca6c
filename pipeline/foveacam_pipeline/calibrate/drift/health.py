"""How good a calibration still is, told by ordinary fixations: nobody has to measure anything.

Every verged fixation says twice where its target is: the eyes by their volts, the wide camera by itself. The
two eyes' lines of sight must also meet in height. The angle between the eyes shows in neither: only a known
distance can tell it. A target that was not found, because both eyes show it elsewhere, says the same by that.
"""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import StereoVolts
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.target_offset import TargetOffset
from foveacam_pipeline.verge.values import Fixation, FixationState

KEPT = 60
"""Older fixations are forgotten: the mounts of that time may not be those of now."""
NEWEST = 9
"""Of so many the middle one says whether something has happened just now."""
FEWEST = 5
GOOD_UP_TO = 2.0
"""Disagreement over what is stated and the measurement itself explains."""
PLACED_SIGMA_WIDE_PX = 0.35
"""How well a fixation finds its place of the wide view again, each axis (as `VergeSettings` has it)."""
ROWS_SIGMA_PX = 0.2
"""How well left against right finds the row, fovea px."""
NORMAL = 1.4826
"""Standard deviation over median of the size, of what is normally distributed."""
MEDIAN_SIGMA = 1.17
"""Standard error of a standard deviation told by the median, times the root of how many there are."""


class HealthVerdict(StrEnum):
    """What is to be done about it."""

    GOOD = "good"
    RECALIBRATE = "recalibrate"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True, kw_only=True)
class FixationResidual:
    """What one fixation says of the calibration, fovea px.

    `across_px`, `down_px`: where the eyes looked, the mean of both, against where the target was. `rows_px`:
    how much lower the right eye looked than the left. `sigma_px`: what is stated of each, the measurement
    included.
    """

    across_px: float
    down_px: float
    rows_px: float
    sigma_px: tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class HealthReport:
    """How good a calibration is.

    `score`: disagreement over what may be expected, about 1 when all is as stated. `horizontal_px`,
    `vertical_px`: median disagreement of the gaze with the target across and down, fovea px; `rows_px`: of
    the two eyes in height. None while too few fixations have been seen.
    """

    verdict: HealthVerdict
    score: float | None
    fixations: int
    horizontal_px: float | None
    vertical_px: float | None
    rows_px: float | None
    detail: str


class HealthMonitor:
    """Takes fixations as they come, and tells the health of the calibration that they were made with."""

    def __init__(self, calibration: Calibration) -> None:
        self._calibration = calibration
        self._calibration_id = calibration.id
        self._residuals: deque[FixationResidual] = deque(maxlen=KEPT)

    @property
    def calibration_id(self) -> str:
        """Whose health it is."""
        return self._calibration_id

    def add(self, fixation: Fixation) -> None:
        """Take a fixation; one that was not found says nothing, unless both eyes showed it elsewhere."""
        residual = residual_of(fixation, self._calibration)
        if residual is not None:
            self._residuals.append(residual)

    @property
    def health(self) -> HealthReport:
        """Return what is known."""
        return health_of(tuple(self._residuals))


def residual_of(fixation: Fixation, calibration: Calibration) -> FixationResidual | None:
    """Return what a fixation says, or None where it says nothing."""
    if fixation.astray is not None:
        return _residual_astray(fixation.astray)
    if fixation.state is not FixationState.VERGED or fixation.volts is None or fixation.point_rig_m is None:
        return None
    x_m, y_m, z_m = fixation.point_rig_m
    f_px = calibration.fovea_f_px
    wide_px = f_px / calibration.wide.fx_px
    left, right = calibration.left.mirror.sigma_rad, calibration.right.mirror.sigma_rad
    placed_px = PLACED_SIGMA_WIDE_PX * wide_px
    return FixationResidual(
        across_px=f_px * (x_m / z_m - math.tan(fixation.target_ax_rad)),
        down_px=f_px * (y_m / z_m - math.tan(fixation.target_ay_rad)),
        rows_px=_rows_px(fixation, fixation.volts, calibration),
        sigma_px=(
            math.hypot(placed_px, f_px * math.hypot(left[0], right[0]) / 2.0),
            math.hypot(placed_px, f_px * math.hypot(left[1], right[1]) / 2.0),
            math.hypot(ROWS_SIGMA_PX, calibration.epipolar_sigma_px(z_m)),
        ),
    )


def _residual_astray(astray: TargetOffset) -> FixationResidual:
    """Return what a target says that both eyes showed far from its place."""
    sigma_px = astray.sigma_px
    return FixationResidual(
        across_px=astray.across_px,
        down_px=astray.down_px,
        rows_px=astray.rows_px,
        sigma_px=(sigma_px, sigma_px, math.sqrt(2.0) * sigma_px),
    )


def health_of(residuals: Sequence[FixationResidual]) -> HealthReport:
    """Return the health that residuals tell; a few that are far off (targets that moved) do not matter.

    It is that of all or of the newest alone, whichever is worse: a knock shows after five fixations that
    tell, not only once most of what is kept was made after it.
    """
    every, newest = _health(residuals), _health(residuals[-NEWEST:])
    return newest if (newest.score or 0.0) > (every.score or 0.0) else every


def _health(residuals: Sequence[FixationResidual]) -> HealthReport:
    if len(residuals) < FEWEST:
        return HealthReport(
            verdict=HealthVerdict.UNKNOWN,
            score=None,
            fixations=len(residuals),
            horizontal_px=None,
            vertical_px=None,
            rows_px=None,
            detail=f"{len(residuals)} fixations so far; {FEWEST} that tell are needed.",
        )
    seen = np.array([(r.across_px, r.down_px, r.rows_px) for r in residuals])
    stated = np.array([r.sigma_px for r in residuals])
    typical = np.median(np.abs(seen), axis=0)
    scores = NORMAL * np.median(np.abs(seen / stated), axis=0) / _by_chance(len(residuals))
    score = float(scores.max())
    verdict = HealthVerdict.GOOD if score <= GOOD_UP_TO else HealthVerdict.RECALIBRATE
    across_px, down_px, rows_px = typical.tolist()
    return HealthReport(
        verdict=verdict,
        score=score,
        fixations=len(residuals),
        horizontal_px=across_px,
        vertical_px=down_px,
        rows_px=rows_px,
        detail=_sentence(verdict, typical, len(residuals)),
    )


def _by_chance(count: int) -> float:
    """Return how much larger than 1 a score of a few is by chance, two standard errors of a median size."""
    return 1.0 + 2.0 * MEDIAN_SIGMA / math.sqrt(count)


def _rows_px(fixation: Fixation, volts: StereoVolts, calibration: Calibration) -> float:
    """Return how much lower the right eye looked than the left at the same thing, fovea px."""
    apart_rad = calibration.meeting(volts).vertical_rad
    remaining_px = next(
        (step.residual_y_px for step in reversed(fixation.steps) if step.residual_y_px is not None), 0.0
    )
    return calibration.fovea_f_px * apart_rad - remaining_px


def _sentence(verdict: HealthVerdict, typical_px: NDArray[np.float64], count: int) -> str:
    across, down, rows = typical_px.tolist()
    seen = (
        f"Over {count} fixations the eyes looked {across:.1f} px across and {down:.1f} px down from the "
        f"target, and {rows:.1f} px apart in height"
    )
    if verdict is HealthVerdict.GOOD:
        return f"{seen}: as stated. The angle between the eyes shows only at a known distance."
    return f"{seen}: more than stated. Check the drift, or calibrate again."
