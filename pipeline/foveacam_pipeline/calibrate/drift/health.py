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
SHARED_SIGMAS, NOISE_SIGMAS = 4.0, 2.0
"""Residuals up to which a calibration is good, standard errors. An error of the calibration, as by mounts
that drift with the temperature, is the same in all fixations and does not average: a single draw must not
exceed it. Noise differs from one to the next, so that the median of many varies little."""
PLACED_SIGMA_WIDE_PX = 0.35
"""Standard error of a fixation's position in the wide view, each axis (as in `VergeSettings`)."""
ROWS_SIGMA_PX = 0.2
"""Standard error of the row match of left to right, fovea px."""
MEDIAN_PER_SIGMA = 0.6745
"""Median absolute value over standard deviation of a normal distribution."""
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
    looked than the left. `shared_px`: stated standard error of the calibration in each, the same for all
    fixations. `noise_px`: that of the measurement, which differs.
    """

    across_px: float
    down_px: float
    rows_px: float
    shared_px: tuple[float, float, float]
    noise_px: tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class HealthReport:
    """Health of a calibration.

    `score`: residuals over the largest that the stated errors allow; above 1 it is time to calibrate.
    `horizontal_px`, `vertical_px`: median disagreement of the gaze with the target across and down, fovea px;
    `rows_px`: of the two eyes in height. All are None while there are too few fixations.
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
        """Add a fixation; ignore a moving target, and a failure unless both eyes saw the target elsewhere."""
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
        return _offset_residual(fixation.target_offset, calibration)
    if fixation.state is not FixationState.VERGED or fixation.volts is None or fixation.point_rig_m is None:
        return None
    if fixation.target_moved:  # by more than any mount drifts, and the further the later the look was
        return None
    x_m, y_m, z_m = fixation.point_rig_m
    f_px = calibration.fovea_f_px
    placed_px = PLACED_SIGMA_WIDE_PX * f_px / calibration.wide.fx_px
    return FixationResidual(
        across_px=f_px * (x_m / z_m - math.tan(fixation.target_ax_rad)),
        down_px=f_px * (y_m / z_m - math.tan(fixation.target_ay_rad)),
        rows_px=_rows_px(fixation, fixation.volts, calibration),
        shared_px=_shared_px(calibration, z_m),
        noise_px=(placed_px, placed_px, ROWS_SIGMA_PX),
    )


def _shared_px(calibration: Calibration, z_m: float) -> tuple[float, float, float]:
    """Return the calibration's standard error of a residual across, down, and between the rows, fovea px."""
    left, right = calibration.left.mirror.sigma_rad, calibration.right.mirror.sigma_rad
    across, down = (calibration.fovea_f_px * math.hypot(left[k], right[k]) / 2.0 for k in (0, 1))
    return across, down, calibration.epipolar_sigma_px(z_m)


def _offset_residual(offset: TargetOffset, calibration: Calibration) -> FixationResidual:
    """Return the residual of a target that both eyes saw far from its expected position."""
    sigma_px = offset.sigma_px
    return FixationResidual(
        across_px=offset.across_px,
        down_px=offset.down_px,
        rows_px=offset.rows_px,
        shared_px=_shared_px(calibration, math.inf),
        noise_px=(sigma_px, sigma_px, math.sqrt(2.0) * sigma_px),
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
    seen = np.abs([(r.across_px, r.down_px, r.rows_px) for r in residuals])
    typical = np.median(seen, axis=0)
    score = float(np.median(seen / _allowed_px(residuals), axis=0).max())
    verdict = HealthVerdict.GOOD if score <= 1.0 else HealthVerdict.RECALIBRATE
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


def _allowed_px(residuals: Sequence[FixationResidual]) -> NDArray[np.float64]:
    """Return (n, 3) the absolute residuals whose median a good calibration stays below, fovea px."""
    shared, noise = np.array([r.shared_px for r in residuals]), np.array([r.noise_px for r in residuals])
    chance = 1.0 + NOISE_SIGMAS * MEDIAN_SIGMA / math.sqrt(len(residuals))
    allowed: NDArray[np.float64] = SHARED_SIGMAS * shared + MEDIAN_PER_SIGMA * chance * noise
    return allowed


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
        return (
            f"{seen}, as the calibration states. Whether the eyes' angle to each other is still right shows "
            "only at targets whose distance is known."
        )
    return f"{seen}: more than stated. Check the drift, or calibrate again."
