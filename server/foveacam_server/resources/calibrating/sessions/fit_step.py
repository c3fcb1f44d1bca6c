"""The fit step of a calibration session: mirror models and rectification (stages 2, 3) from its sweeps.

It also describes the fit: every model's score, the paper's model, the parallax of Eq. 1.
"""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import FoveaError, NotCalibrated
from foveacam_pipeline.calibrate.fit import session_fit
from foveacam_pipeline.calibrate.fit.fit import DOING
from foveacam_pipeline.calibrate.fit.fit_pictures import fit_pictures
from foveacam_pipeline.calibrate.fit.measured import DistanceSource, NominalRig, StationParallax
from foveacam_pipeline.calibrate.fit.session_fit import FitResult, FitSettings
from foveacam_pipeline.calibrate.records.aggregate import sweep_paths
from foveacam_pipeline.calibrate.sweep.sweep_file import load_sweep
from foveacam_pipeline.calibrate.watcher import ProcedureWatcher, raise_if_cancelled
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.content import content_id, plain
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.verge.aim import EYES
from foveacam_server.foundation.names import utc_now
from foveacam_server.foundation.quantities import deg
from foveacam_server.resources.calibrating.sessions.options import FitOptions
from foveacam_server.resources.calibrating.sessions.pictures import draw_png, write_picture
from foveacam_server.resources.calibrating.sessions.schema import (
    FieldScoreDocument,
    FitDocument,
    FitFigures,
    ModelScoreDocument,
    MountDriftDocument,
    eye_of,
)
from foveacam_server.resources.calibrating.sessions.sessions import (
    FIT,
    CalibrationSession,
    FinishedFit,
    FinishedSteps,
)
from foveacam_server.resources.calibrating.sessions.step_environment import CalibrationRegistry, StepWatcher

STEP = "fit"
PICTURES = 6
"""Largest number of pictures of a fit, counted as steps of its progress."""


def fit_session(
    session: CalibrationSession,
    options: FitOptions,
    wide: Intrinsics,
    *,
    registry: CalibrationRegistry,
    watch: StepWatcher,
) -> Calibration:
    """Fit, store and return a calibration, with its pictures.

    Cancelled before the last picture is drawn, it stores nothing; after that, everything.
    """
    watch.stage(STEP)
    fit_watch = _FitWatcher(watch)
    result = compute_fit(session, options, wide, watch=fit_watch)
    pictures = _pictures(session, result, watch=fit_watch)
    raise_if_cancelled(watch, doing=DOING)
    calibration = result.calibration
    registry.add(calibration)
    session.write(FIT, _describe(result))
    for name, png in pictures.items():
        write_picture(session, name, png)
    session.add_calibration(calibration.id)
    finished = FinishedFit(of=inputs_of(session, options, wide), calibration_id=calibration.id)
    session.finish_steps(FinishedSteps(fit=finished))
    watch.fitted(calibration)
    watch.progress(fit_watch.total, total=fit_watch.total, note=f"calibration {calibration.id}")
    return calibration


def earlier_fit(
    session: CalibrationSession, options: FitOptions, wide: Intrinsics, *, registry: CalibrationRegistry
) -> Calibration | None:
    """Return the calibration of an earlier fit with these inputs; None when there is none."""
    how = session.finished.fit
    if how is None or how.of != inputs_of(session, options, wide):
        return None
    try:
        return registry.get(how.calibration_id)
    except FoveaError:
        return None  # its calibration was deleted meanwhile


def inputs_of(session: CalibrationSession, options: FitOptions, wide: Intrinsics) -> str:
    """Return the hash of a fit's inputs; without repeated nodes, which only refine it."""
    sweeps = [load_sweep(path) for path in sweep_paths(session.folder)]
    settings = options.model_dump() | {"label": options.label or session.head.label}
    poses = [[[pose.run, pose.t_ns] for pose in sweep.poses] for sweep in sweeps]
    return content_id(plain([settings, wide, [sweep.header.station.name for sweep in sweeps], poses]))


class _FitWatcher:
    """Forwards a fit's progress, with the pictures that follow added to the total."""

    def __init__(self, watch: ProcedureWatcher) -> None:
        self._watch = watch
        self.total = PICTURES

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        """Forward the progress."""
        self.total = total + PICTURES
        self._watch.progress(done, total=self.total, note=note)

    def cancelled(self) -> bool:
        """Return whether the watcher has cancelled the fit."""
        return self._watch.cancelled()

    def show(self, name: str, image: NDArray[np.uint8]) -> None:
        """Forward the picture."""
        self._watch.show(name, image)


def _pictures(session: CalibrationSession, result: FitResult, *, watch: _FitWatcher) -> dict[str, bytes]:
    """Return the fit's pictures as PNG, without storing them."""
    pictures, fitted = {}, watch.total - PICTURES
    for number, (name, make) in enumerate(fit_pictures(result).items()):
        raise_if_cancelled(watch, doing=DOING)
        watch.progress(fitted + number, total=fitted, note="drawing")
        png = draw_png(session, name, make)
        if png is not None:
            pictures[name] = png
    return pictures


def compute_fit(
    session: CalibrationSession,
    options: FitOptions,
    wide: Intrinsics,
    *,
    watch: ProcedureWatcher | None = None,
) -> FitResult:
    """Return the fit to a session's sweeps; write nothing.

    Raise `Cancelled` soon after `watch` is cancelled.
    """
    sweeps = [load_sweep(path) for path in sweep_paths(session.folder)]
    if not sweeps:
        raise NotCalibrated(
            f"session {session.id} holds no sweep of the mirrors yet",
            asked="a fit",
            found="no sweep",
            remedy="run the step mirrors first",
        )
    head = session.head
    result = session_fit.fit_session(
        sweeps,
        wide,
        drawing=NominalRig(rig_id=head.rig_id, baseline_m=head.baseline_m),
        label=options.label or head.label,
        settings=_settings(options),
        session_id=session.id,
        watch=watch,
    )
    created_utc = utc_now().replace("Z", "+00:00")
    calibration = replace(result.calibration, created_utc=created_utc, origin="measured")
    return replace(result, calibration=calibration, fit=replace(result.fit, calibration=calibration))


def _settings(options: FitOptions) -> FitSettings:
    return FitSettings(
        mirror_order=options.order,
        field_order=options.field_order,
        pose_by_pose=options.pose_by_pose,
        all_distances=options.use_all_distances,
        distance=DistanceSource(options.distance),
        compare=options.compare,
    )


def _describe(result: FitResult) -> FitDocument:
    return FitDocument(
        calibration_id=result.calibration.id,
        models=[
            ModelScoreDocument(
                name=score.name,
                order=score.order,
                eye=eye_of(role),
                loo_deg=_deg(score.loo_rad),
                chosen=score.chosen,
            )
            for role in EYES
            for score in result.models[role]
        ],
        fields=[
            FieldScoreDocument(
                name=score.name,
                order=score.order,
                eye=eye_of(role),
                loo_px=round(score.loo_px, 4),
                chosen=score.chosen,
            )
            for role in EYES
            for score in result.fit.fields[role].scores
        ],
        volts_roundtrip_max_lsb=round(result.volts_roundtrip_max_lsb, 4),
        paper=_paper(result),
        parallax={parallax.station: _parallax(parallax) for parallax in result.parallax},
        drift=_drift(result),
    )


def _drift(result: FitResult) -> dict[str, MountDriftDocument] | None:
    """Return the drift of the mounts during the sweeps; None when it was not measured."""
    if result.drift is None:
        return None
    f_px = result.calibration.fovea_f_px
    return {
        role.value: MountDriftDocument(
            px_per_minute=round(f_px * drift.rad_per_minute, 3),
            moved_px=round(f_px * drift.moved_rad, 3),
            sigma_px=round(f_px * math.hypot(*drift.sigma_rad), 3),
            minutes=round(drift.minutes, 2),
            pieces=drift.pieces,
            visits=drift.visits,
            knocks_px=tuple(round(f_px * step_rad, 2) for step_rad in drift.knocks_rad),
        )
        for role, drift in result.drift.items()
    }


def _paper(result: FitResult) -> FitFigures | None:
    """Return the paper's model of the same data, and the scores with each of our additions."""
    paper = result.paper
    if paper is None:
        return None
    return {
        "station": paper.station,
        "loo_deg": {role.value: _deg(paper.fit.mirrors[role].model.loo_rad) for role in EYES},
        "rectify_loo_px": {role.value: round(paper.fit.fields[role].field.loo_px, 4) for role in EYES},
        "volts_roundtrip_max_lsb": round(paper.roundtrip_lsb, 2),
        "steps": [
            {
                "name": variant.name,
                "pointing_rms_px": round(variant.pointing_rms_px, 3),
                "rectification_rms_px": round(variant.rectification_rms_px, 3),
                "epipolar_rms_px": round(variant.epipolar_rms_px, 3),
            }
            for variant in result.variants
        ],
    }


def _parallax(parallax: StationParallax) -> FitFigures:
    return {
        "print_m": round(parallax.print_m, 4),
        "print_scatter_m": round(parallax.print_scatter_m, 5),
        "tape_m": parallax.tape_m,
        "rms_deg": deg(parallax.rms_rad),
        "largest_deg": deg(parallax.largest_rad),
        "corrected": parallax.corrected,
        "words": parallax.words,
    }


def _deg(pair_rad: tuple[float, float]) -> tuple[float, float]:
    across_rad, down_rad = pair_rad
    return deg(across_rad), deg(down_rad)
