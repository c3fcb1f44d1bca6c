"""Stages 2 and 3 fitted: a calibration from everything that a session measured, and how good it is."""

import math
from dataclasses import replace

from foveacam_hardware.contract import NotCalibrated, Role
from foveacam_pipeline.calibrate.fit import FitChoice, RigFit, fit_rig
from foveacam_pipeline.calibrate.measured import Measured, RigDrawing, rig_sweep
from foveacam_pipeline.calibrate.parallax import Parallax
from foveacam_pipeline.calibrate.sweep import Sweep
from foveacam_pipeline.calibrate.sweep_file import load_sweep
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_server.calibrating.documents import FIT
from foveacam_server.calibrating.options import FitOptions
from foveacam_server.calibrating.sessions import CalibrationSession
from foveacam_server.calibrating.sweep_documents import sweep_paths
from foveacam_server.calibrating.workplace import Registry, StepWatcher
from foveacam_server.runtime.names import utc_now
from foveacam_server.runtime.store import Document

STAGES = 4
EYES = (Role.LEFT, Role.RIGHT)


def fit_session(
    session: CalibrationSession,
    options: FitOptions,
    wide: Intrinsics,
    *,
    registry: Registry,
    watch: StepWatcher,
) -> Calibration:
    """Fit, keep and return a calibration; its pictures are drawn as well."""
    watch.stage("fit")
    watch.progress(0, total=STAGES, note="reading what was measured")
    head = session.head
    sweeps = sweeps_of(session, all_distances=options.use_all_distances)
    label = options.label or head.label
    measured = rig_sweep(
        sweeps, wide, drawing=RigDrawing(rig_id=head.rig_id, baseline_m=head.baseline_m), label=label
    )
    created_utc = utc_now().replace("Z", "+00:00")
    rig = replace(measured.rig, origin="measured", created_utc=created_utc)
    watch.progress(1, total=STAGES, note="fitting the mirrors and the rectification")
    fit = fit_rig(rig, _choice(options))
    calibration = replace(fit.calibration, session_id=session.id)
    watch.progress(2, total=STAGES, note="fitting the paper's plain model beside it")
    document = fit_document(fit, measured, calibration)
    registry.add(calibration)
    session.write(FIT, document)
    session.add_calibration(calibration.id)
    watch.fitted(calibration)
    watch.progress(3, total=STAGES, note="drawing")
    watch.progress(STAGES, total=STAGES, note=f"calibration {calibration.id}")
    return calibration


def sweeps_of(session: CalibrationSession, *, all_distances: bool) -> list[Sweep]:
    """Return the sweeps of a session, or the one over the farthest markers alone."""
    sweeps = [load_sweep(path) for path in sweep_paths(session.folder)]
    if not sweeps:
        raise NotCalibrated(
            f"session {session.id} holds no sweep of the mirrors yet; run the step mirrors first",
            asked="a fit",
            found="no sweep",
            remedy="run the step mirrors first",
        )
    if all_distances:
        return sweeps
    return [max(sweeps, key=lambda sweep: sweep.header.station.distance_m or math.inf)]


def fit_document(fit: RigFit, measured: Measured, calibration: Calibration) -> Document:
    """Return what a fit found: every model's score, and the parallax of Eq. 1."""
    return {
        "calibration_id": calibration.id,
        "models": [
            {
                "name": score.name,
                "order": score.order,
                "eye": role.value,
                "loo_deg": [round(math.degrees(error), 5) for error in score.loo_rad],
                "chosen": score.chosen,
            }
            for role in EYES
            for score in fit.mirrors[role].scores
        ],
        "paper": None,
        "parallax": {parallax.station: _parallax(parallax) for parallax in measured.parallax},
    }


def _parallax(parallax: Parallax) -> Document:
    return {
        "print_m": round(parallax.print_m, 4),
        "print_scatter_m": round(parallax.print_scatter_m, 5),
        "tape_m": parallax.tape_m,
        "rms_deg": round(math.degrees(parallax.rms_rad), 5),
        "largest_deg": round(math.degrees(parallax.largest_rad), 5),
        "corrected": parallax.corrected,
        "words": parallax.words,
    }


def _choice(options: FitOptions) -> FitChoice:
    if options.order is None:
        return FitChoice()
    return FitChoice(mirror_orders=(options.order,), spring_orders=())
