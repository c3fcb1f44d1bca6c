"""Fit of a rig's calibration to the samples of its sweeps; models are chosen by leave-one-out error."""

import logging
import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.fit.fit_homography import ORDERS as FIELD_ORDERS
from foveacam_pipeline.calibrate.fit.fit_homography import FieldFit, apply_field, fit_fields
from foveacam_pipeline.calibrate.fit.mirror_models import (
    ORDERS,
    SPRING_ORDERS,
    MirrorFit,
    fit_mirror_models,
)
from foveacam_pipeline.calibrate.fit.pivot import PIVOT_TOLERANCE_M, PivotFit, fit_pivot, mount_sigma_rad
from foveacam_pipeline.calibrate.fit.samples import EyeSweep, RigSweep
from foveacam_pipeline.calibrate.watcher import ProcedureWatcher, SilentWatcher, raise_if_cancelled
from foveacam_pipeline.models.calibration import Calibration, EyeCalibration
from foveacam_pipeline.models.homography import HomographyField

_PUPIL_STEPS_M = (10e-3, 1e-3)
_PUPIL_ORDER = 3
DOING = "the fit"

FULL_FIT_PARTS = 4
"""Duration of a fit that tries every model, as a multiple of a fit of known models."""


__all__ = [
    "PIVOT_TOLERANCE_M",
    "FitChoice",
    "PivotFit",
    "RigFit",
    "fit_calibration",
    "fit_pivot",
    "fit_rig",
]

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class FitChoice:
    """Candidate models of a fit.

    `mirror_orders`, `spring_orders`, `field_orders`: of the polynomials; one alone leaves no choice.
    `pose_by_pose`: fit one homography a pose and polynomials to those, as the paper does. `fits_pivots`: fit
    the pivots of the gazes and the pupil, if the targets' distances show them; else they are nominal.
    """

    mirror_orders: tuple[int, ...] = ORDERS
    spring_orders: tuple[int, ...] = SPRING_ORDERS
    field_orders: tuple[int, ...] = FIELD_ORDERS
    pose_by_pose: bool = False
    fits_pivots: bool = True


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RigFit:
    """A calibration and, for each eye, the scores and residuals of the candidate models.

    `sweeps`: the measurements as they were fitted, with gazes
    from the eyes' reference points.
    """

    calibration: Calibration
    mirrors: dict[Role, MirrorFit]
    fields: dict[Role, FieldFit]
    sweeps: dict[Role, EyeSweep]


def fit_calibration(sweep: RigSweep) -> Calibration:
    """Return the fitted calibration; sweeps over two depths also give baseline, pivots and pupil."""
    return fit_rig(sweep).calibration


def fit_rig(
    sweep: RigSweep, choice: FitChoice | None = None, *, watch: ProcedureWatcher | None = None
) -> RigFit:
    """Fit both eyes and return every candidate's score; raise Cancelled soon after `watch` has cancelled.

    The first rectification refines the gaze of each pose with all corners, also where the marker was off
    centre; then everything is fitted again.
    """
    choice, watch = choice or FitChoice(), watch or SilentWatcher()
    first_pupil_m = _fit_pupil(sweep, choice, start_m=sweep.pupil_m, steps_m=_PUPIL_STEPS_M)
    raise_if_cancelled(watch, doing=DOING)
    refined = replace(
        sweep,
        left=_refined_gazes(sweep, sweep.left, pupil_m=first_pupil_m),
        right=_refined_gazes(sweep, sweep.right, pupil_m=first_pupil_m),
    )
    pupil_m = _fit_pupil(refined, choice, start_m=first_pupil_m, steps_m=_PUPIL_STEPS_M[-1:])
    return _fit_eyes(refined, choice, pupil_m=pupil_m, watch=watch)


def _fit_eyes(sweep: RigSweep, choice: FitChoice, *, pupil_m: float, watch: ProcedureWatcher) -> RigFit:
    eyes = {Role.LEFT: sweep.left, Role.RIGHT: sweep.right}
    pivots = {role: fit_pivot(eye) if choice.fits_pivots else PivotFit() for role, eye in eyes.items()}
    widened = (pivots[Role.RIGHT].offset_m[0] - pivots[Role.LEFT].offset_m[0]) / 2.0
    mirrors, fields, fitted = {}, {}, {}
    for role, eye in eyes.items():
        raise_if_cancelled(watch, doing=DOING)
        mirrors[role] = fit_mirror_models(
            eye.volts_v,
            _gaze_from_pivot(eye, pivots[role]),
            group=eye.group,
            orders=choice.mirror_orders,
            spring_orders=choice.spring_orders,
        )
        gaze = mirrors[role].model.forward(eye.volts_v)
        fields[role] = _fit_fields(sweep, eye, gaze, pupil_m=pupil_m, choice=choice)
        shift = -widened if role is Role.LEFT else widened
        fitted[role] = _eye_calibration(
            eye, mirrors[role], fields[role].field, pivots[role], reference_shift_m=shift
        )
    calibration = Calibration(
        rig_id=sweep.rig_id,
        created_utc=sweep.created_utc,
        origin=sweep.origin,
        label=sweep.label,
        wide=sweep.wide,
        left=fitted[Role.LEFT],
        right=fitted[Role.RIGHT],
        baseline_m=sweep.baseline_m + 2.0 * widened,
        fovea_f_px=sweep.fovea_f_px,
        fovea_width=sweep.fovea_width,
        fovea_height=sweep.fovea_height,
        pupil_m=pupil_m,
    )
    return RigFit(calibration=calibration, mirrors=mirrors, fields=fields, sweeps=eyes)


def _eye_calibration(
    eye: EyeSweep, mirror: MirrorFit, field: HomographyField, pivot: PivotFit, *, reference_shift_m: float
) -> EyeCalibration:
    x_m, y_m, z_m = pivot.offset_m
    across, down = mirror.model.sigma_rad
    drifts_x, drifts_y = mount_sigma_rad(eye)
    sigma_rad = math.hypot(across, drifts_x), math.hypot(down, drifts_y)
    return EyeCalibration(
        mirror=replace(mirror.model, sigma_rad=sigma_rad),
        homography=field,
        pivot_offset_m=(x_m - reference_shift_m, y_m, z_m),
        pivot_sigma_m=pivot.sigma_m,
        reference_depth_m=1.0 / float(np.mean(1.0 / eye.depth_m)),
    )


def _gaze_from_pivot(eye: EyeSweep, pivot: PivotFit) -> NDArray[np.float64]:
    """Return the (n, 2) gaze angles from the pivot; the sweep holds them from the reference point."""
    offset = np.array(pivot.offset_m)
    depth = eye.depth_m[:, None]
    gaze: NDArray[np.float64] = np.arctan((np.tan(eye.angles_rad) * depth - offset[:2]) / (depth - offset[2]))
    return gaze


def _refined_gazes(sweep: RigSweep, eye: EyeSweep, *, pupil_m: float) -> EyeSweep:
    """Return the sweep of an eye with gazes measured by all corners through a first rectification."""
    choice = FitChoice(field_orders=(_PUPIL_ORDER,))
    field = _fit_fields(sweep, eye, eye.angles_rad, pupil_m=pupil_m, choice=choice).field
    places = apply_field(field, eye.angles_rad, eye.raw_px) * _pupil_scale(eye, pupil_m)[:, None, None]
    shift_px = np.nanmedian(eye.plane_px - places, axis=1)
    angles = np.arctan(np.tan(eye.angles_rad) + shift_px / sweep.fovea_f_px)
    return replace(eye, angles_rad=angles, plane_px=eye.plane_px - shift_px[:, None, :])


def _pupil_scale(eye: EyeSweep, pupil_m: float) -> NDArray[np.float64]:
    """Return the (n,) magnifications of the targets seen from a pupil behind the pivot, against the pivot."""
    forward = 1.0 / np.sqrt(1.0 + np.sum(np.tan(eye.angles_rad) ** 2, axis=1))
    return np.asarray(1.0 + pupil_m * forward / eye.depth_m, dtype=np.float64)


def _fit_fields(
    sweep: RigSweep, eye: EyeSweep, gaze: NDArray[np.float64], *, pupil_m: float, choice: FitChoice
) -> FieldFit:
    return fit_fields(
        gaze,
        eye.raw_px,
        eye.plane_px / _pupil_scale(eye, pupil_m)[:, None, None],
        width=sweep.fovea_width,
        height=sweep.fovea_height,
        orders=choice.field_orders,
        pose_by_pose=choice.pose_by_pose,
    )


def _fit_pupil(sweep: RigSweep, choice: FitChoice, *, start_m: float, steps_m: tuple[float, ...]) -> float:
    """Return the pupil's distance behind the pivots at which near and far targets agree best, m."""
    if not (choice.fits_pivots and sweep.left.has_two_depths and sweep.right.has_two_depths):
        return start_m
    cubic = FitChoice(field_orders=(_PUPIL_ORDER,))

    def disagreement(pupil_m: float) -> float:
        fits = [
            _fit_fields(sweep, eye, eye.angles_rad, pupil_m=pupil_m, choice=cubic).field
            for eye in (sweep.left, sweep.right)
        ]
        return fits[0].loo_px ** 2 + fits[1].loo_px ** 2

    pupil_m = start_m
    for step_m in steps_m:  # the sum of squares is nearly a parabola near its minimum
        below, at, above = (disagreement(pupil_m + side * step_m) for side in (-1.0, 0.0, 1.0))
        pupil_m += 0.5 * step_m * (below - above) / (below - 2.0 * at + above)
    logger.info("pupil %.2f mm behind the pivots", 1e3 * pupil_m)
    return pupil_m


class FitProgress:
    """Counts the finished parts of a fit and reports them to the watcher, which may cancel between parts."""

    def __init__(self, watch: ProcedureWatcher, *, comparisons: int) -> None:
        self.watch = watch
        self._total = FULL_FIT_PARTS + comparisons + 1
        self._done = 0

    def begin(self, what: str) -> None:
        """Report the next part; raise Cancelled when the watcher has cancelled."""
        raise_if_cancelled(self.watch, doing=DOING)
        self.watch.progress(self._done, total=self._total, note=what)

    def end(self, parts: int = 1) -> None:
        """Count the current part as finished."""
        self._done += parts

    def finish(self) -> None:
        """Report that everything is finished, although parts may have been skipped."""
        self._done = self._total
        self.begin("fitted")
