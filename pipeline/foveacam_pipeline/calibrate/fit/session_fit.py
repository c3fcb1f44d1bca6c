"""Fit of a session's sweeps: the calibration, its scores, and the comparison with the paper's model."""

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.calibrate.fit.fit import FULL_FIT_PARTS, FitChoice, FitProgress, RigFit, fit_rig
from foveacam_pipeline.calibrate.fit.measured import (
    DistanceSource,
    NominalRig,
    StationParallax,
    SweepMeasurements,
    reduce_sweeps,
)
from foveacam_pipeline.calibrate.fit.mirror_models import MirrorScore
from foveacam_pipeline.calibrate.fit.paper_model import PaperModel, farthest_sweep, fit_paper
from foveacam_pipeline.calibrate.fit.samples import MountDrift
from foveacam_pipeline.calibrate.fit.variants import FOLDS, MOST_VARIANTS, VariantScore, compare_variants
from foveacam_pipeline.calibrate.sweep.sweep import Sweep
from foveacam_pipeline.calibrate.watcher import ProcedureWatcher, SilentWatcher
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.models.mirror import DAC_STEP_V, MirrorModel

ROUNDTRIP_SIDE = 41

logger = logging.getLogger(__name__)

_Compared = TypeVar("_Compared")


@dataclass(frozen=True, slots=True, kw_only=True)
class FitSettings:
    """Options of a fit that the operator may choose.

    `mirror_order`, `field_order`: fixed orders of the polynomials, instead of a choice. `pose_by_pose`:
    rectify from one homography a pose. `all_distances`: use the sweeps of every station, else the farthest
    alone. `distance`: source of the targets' distances. `compare`: also score our additions one by one
    (slower).
    """

    mirror_order: int | None = None
    field_order: int | None = None
    pose_by_pose: bool = False
    all_distances: bool = True
    distance: DistanceSource = DistanceSource.PRINT
    compare: bool = True

    @property
    def choice(self) -> FitChoice:
        """The candidate models."""
        choice = FitChoice(pose_by_pose=self.pose_by_pose)
        if self.mirror_order is not None:
            choice = replace(choice, mirror_orders=(self.mirror_order,), spring_orders=())
        if self.field_order is not None:
            choice = replace(choice, field_orders=(self.field_order,))
        return choice


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FitResult:
    """A calibration, its scores and the comparisons.

    `fit`: model scores and residuals for each eye. `measured`: the fitted measurements. `paper`: the paper's
    model of the same data, None where one station has too few poses for it. `variants`: scores of our
    additions one by one on nodes left out; empty unless requested, and where a part of the poses is too few.
    `volts_roundtrip_max_lsb`: largest error of volts -> angles -> volts over the calibrated field, DAC steps.
    """

    calibration: Calibration
    fit: RigFit
    measured: SweepMeasurements
    paper: PaperModel | None
    variants: tuple[VariantScore, ...]
    volts_roundtrip_max_lsb: float

    @property
    def parallax(self) -> tuple[StationParallax, ...]:
        """Eq. 1 at every station."""
        return self.measured.parallax

    @property
    def drift(self) -> dict[Role, MountDrift] | None:
        """Drift of each eye's mount during the sweeps; None when no nodes were visited again."""
        return self.measured.drift

    @property
    def models(self) -> dict[Role, tuple[MirrorScore, ...]]:
        """The scores of each mirror's models, the paper's cubic and the chosen one marked."""
        return {role: mirror.scores for role, mirror in self.fit.mirrors.items()}


def fit_session(
    sweeps: Sequence[Sweep],
    wide: Intrinsics,
    *,
    drawing: NominalRig,
    label: str,
    settings: FitSettings | None = None,
    session_id: str | None = None,
    watch: ProcedureWatcher | None = None,
) -> FitResult:
    """Fit the sweeps of a session; raise InvalidInput or NotCalibrated naming what is wrong with them.

    Raise Cancelled soon after `watch` has cancelled.
    """
    settings = settings or FitSettings()
    comparisons = FOLDS * MOST_VARIANTS if settings.compare else 0
    progress = FitProgress(watch or SilentWatcher(), comparisons=comparisons)
    progress.begin("mirrors and rectification")
    measured = reduce_sweeps(sweeps, wide, drawing=drawing, label=label, distance=settings.distance)
    far = farthest_sweep(sweeps, [parallax.print_m for parallax in measured.parallax])
    if not settings.all_distances and len(sweeps) > 1:
        measured = reduce_sweeps([far], wide, drawing=drawing, label=label, distance=settings.distance)
    fit = fit_rig(measured.rig, settings.choice, watch=progress.watch)
    progress.end(FULL_FIT_PARTS)
    calibration = replace(fit.calibration, session_id=session_id)
    compared = _if_possible(lambda: _variants(sweeps, measured, fit, progress)) if settings.compare else None
    progress.begin("the paper's model")
    paper = _if_possible(lambda: fit_paper(far, wide, drawing=drawing))
    progress.finish()
    return FitResult(
        calibration=calibration,
        fit=replace(fit, calibration=calibration),
        measured=measured,
        paper=paper,
        variants=compared or (),
        volts_roundtrip_max_lsb=max(roundtrip_lsb(mirror.model) for mirror in fit.mirrors.values()),
    )


def _if_possible(compare: Callable[[], _Compared]) -> _Compared | None:
    """Return the result of a comparison, or None when it has too few poses, which must not fail the fit."""
    try:
        return compare()
    except InvalidInput as error:
        logger.info("left out of the comparison: %s", error)
        return None


def _variants(
    sweeps: Sequence[Sweep], measured: SweepMeasurements, fit: RigFit, progress: FitProgress
) -> tuple[VariantScore, ...]:
    """Return the scores of our additions on the sweeps that were used."""
    used = [sweep for sweep in sweeps if sweep.header.station.name in {p.station for p in measured.parallax}]
    rig = measured.rig
    drawing = NominalRig(rig_id=rig.rig_id, baseline_m=rig.baseline_m, fovea_f_px=rig.fovea_f_px, pupil_m=0.0)
    plain = reduce_sweeps(
        used, rig.wide, drawing=drawing, label="paper", distance=DistanceSource.UNKNOWN, take_out_drift=False
    )
    far = int(np.argmax([parallax.print_m for parallax in measured.parallax]))
    return compare_variants(measured, plain, fit, far=far, progress=progress)


def roundtrip_lsb(mirror: MirrorModel, *, side: int = ROUNDTRIP_SIDE) -> float:
    """Return the largest error of volts -> angles -> volts on a grid over the calibrated volts, DAC steps."""
    line = np.linspace(-1.0, 1.0, side)
    volts = np.array([(x, y) for x in line for y in line]) * np.array(mirror.max_v)
    angles = mirror.angles_of(volts)
    inside = mirror.inside(angles)
    if not inside.any():
        raise InvalidInput("mirror: its inverse reaches none of its own calibrated gazes; sweep it again")
    return float(np.abs(mirror.volts_for(angles[inside]) - volts[inside]).max() / DAC_STEP_V)
