"""Health of a calibration, estimated from ordinary fixations without extra measurements.

Every verged fixation locates its target twice, by the eyes' volts and by the wide camera, and the lines of
sight of both eyes must agree in height. The angle between the eyes can be checked only at a known distance. A
target that both eyes see away from its expected position counts as well.
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
from foveacam_pipeline.verge.matching.target_offset import TargetOffset
from foveacam_pipeline.verge.values import Fixation, FixationState

MAX_RESIDUALS = 60
"""Number of residuals used; older fixations are dropped because the mounts may have moved since."""
NEWEST_COUNT = 9
"""Number of newest fixations whose median shows a sudden change."""
MIN_FIXATIONS = 5
MAX_GOOD_SCORE = 2.0
"""Maximum score of a good calibration: ratio of the residuals to their stated errors."""
PLACED_SIGMA_WIDE_PX = 0.35
"""Standard error of a fixation's position in the wide view, each axis (as in `VergeSettings`)."""
ROWS_SIGMA_PX = 0.2
"""Standard error of the row match of left to right, fovea px."""
SIGMA_PER_MEDIAN = 1.4826
"""Standard deviation over median absolute value of a normal distribution."""
MEDIAN_SIGMA = 1.17
"""Standard error of a standard deviation estimated from that median, times the root of the sample count."""


class HealthVerdict(StrEnum):
    """Verdict on a calibration."""

    GOOD = "good"
    RECALIBRATE = "recalibrate"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True, kw_only=True)
class FixationResidual:
    """Residual of one fixation against the calibration, fovea px.

    `across_px`, `down_px`: mean gaze of the eyes minus the target. `rows_px`: how much lower the right eye
    looked than the left. `sigma_px`: stated standard error of each, measurement noise included.
    """

    across_px: float
    down_px: float
    rows_px: float
    sigma_px: tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class HealthReport:
    """Health of a calibration.

    `score`: residuals over their stated errors, about 1 for a valid calibration. `horizontal_px`,
    `vertical_px`: median disagreement of the gaze with the target across and down, fovea px; `rows_px`: of
    the two eyes in height. All are None while there are too few fixations.
    """

    verdict: HealthVerdict
    score: float | None
    fixations: int
    horizontal_px: float | None
    vertical_px: float | None
    rows_px: float | None
    detail: str


class HealthMonitor:
    """Collects fixations and reports the health of the calibration that they were made with."""

    def __init__(self, calibration: Calibration) -> None:
        self._calibration = calibration
        self._calibration_id = calibration.id
        self._residuals: deque[FixationResidual] = deque(maxlen=MAX_RESIDUALS)

    @property
    def calibration_id(self) -> str:
        """Id of the calibration."""
        return self._calibration_id

    def add(self, fixation: Fixation) -> None:
        """Add a fixation; a failed one is ignored, unless both eyes saw the target elsewhere."""
        residual = fixation_residual(fixation, self._calibration)
        if residual is not None:
            self._residuals.append(residual)

    @property
    def health(self) -> HealthReport:
        """Return the health so far."""
        return report_health(tuple(self._residuals))


def fixation_residual(fixation: Fixation, calibration: Calibration) -> FixationResidual | None:
    """Return the residual of a fixation; None where it cannot be computed."""
    if fixation.target_offset is not None:
        return _offset_residual(fixation.target_offset)
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


def _offset_residual(offset: TargetOffset) -> FixationResidual:
    """Return the residual of a target that both eyes saw far from its expected position."""
    sigma_px = offset.sigma_px
    return FixationResidual(
        across_px=offset.across_px,
        down_px=offset.down_px,
        rows_px=offset.rows_px,
        sigma_px=(sigma_px, sigma_px, math.sqrt(2.0) * sigma_px),
    )


def report_health(residuals: Sequence[FixationResidual]) -> HealthReport:
    """Return the health estimated from residuals; medians tolerate a few outliers (targets that moved).

    It is that of all residuals or of the newest alone, whichever is worse, so that a knock shows after five
    fixations with a residual.
    """
    every, newest = _report(residuals), _report(residuals[-NEWEST_COUNT:])
    return newest if (newest.score or 0.0) > (every.score or 0.0) else every


def _report(residuals: Sequence[FixationResidual]) -> HealthReport:
    if len(residuals) < MIN_FIXATIONS:
        return HealthReport(
            verdict=HealthVerdict.UNKNOWN,
            score=None,
            fixations=len(residuals),
            horizontal_px=None,
            vertical_px=None,
            rows_px=None,
            detail=f"{len(residuals)} fixations so far; {MIN_FIXATIONS} on textured targets are needed.",
        )
    seen = np.array([(r.across_px, r.down_px, r.rows_px) for r in residuals])
    stated = np.array([r.sigma_px for r in residuals])
    typical = np.median(np.abs(seen), axis=0)
    scores = SIGMA_PER_MEDIAN * np.median(np.abs(seen / stated), axis=0) / _chance_factor(len(residuals))
    score = float(scores.max())
    verdict = HealthVerdict.GOOD if score <= MAX_GOOD_SCORE else HealthVerdict.RECALIBRATE
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


def _chance_factor(count: int) -> float:
    """Return the score that `count` residuals of a good calibration stay below (1 + 2 standard errors)."""
    return 1.0 + 2.0 * MEDIAN_SIGMA / math.sqrt(count)


def _rows_px(fixation: Fixation, volts: StereoVolts, calibration: Calibration) -> float:
    """Return how much lower the right eye looked than the left at the same point, fovea px."""
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
