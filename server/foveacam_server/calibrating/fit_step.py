"""Stages 2 and 3 fitted: a calibration from everything that a session measured, and how good it is."""

from dataclasses import replace

from foveacam_hardware.contract import NotCalibrated
from foveacam_pipeline.calibrate.fit import session_fit
from foveacam_pipeline.calibrate.fit.fit_pictures import fit_pictures
from foveacam_pipeline.calibrate.fit.measured import Distance, RigDrawing
from foveacam_pipeline.calibrate.fit.session_fit import FitResult, FitSettings
from foveacam_pipeline.calibrate.sweep.sweep_file import load_sweep
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_server.calibrating.documents import FIT
from foveacam_server.calibrating.fit_documents import fit_document
from foveacam_server.calibrating.options import FitOptions
from foveacam_server.calibrating.pictures import draw
from foveacam_server.calibrating.sessions import CalibrationSession
from foveacam_server.calibrating.sweep_documents import sweep_paths
from foveacam_server.calibrating.workplace import Registry, StepWatcher
from foveacam_server.runtime.names import utc_now

STAGES = 3


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
    watch.progress(
        0, total=STAGES, note="fitting mirrors and rectification, and the paper's model beside them"
    )
    result = fit_of(session, options, wide)
    calibration = result.calibration
    registry.add(calibration)
    session.write(FIT, fit_document(result))
    session.add_calibration(calibration.id)
    watch.fitted(calibration)
    watch.progress(STAGES - 1, total=STAGES, note="drawing")
    draw(session, fit_pictures(result))
    watch.progress(STAGES, total=STAGES, note=f"calibration {calibration.id}")
    return calibration


def fit_of(session: CalibrationSession, options: FitOptions, wide: Intrinsics) -> FitResult:
    """Return what can be fitted to the sweeps of a session; nothing is written."""
    sweeps = [load_sweep(path) for path in sweep_paths(session.folder)]
    if not sweeps:
        raise NotCalibrated(
            f"session {session.id} holds no sweep of the mirrors yet; run the step mirrors first",
            asked="a fit",
            found="no sweep",
            remedy="run the step mirrors first",
        )
    head = session.head
    result = session_fit.fit_session(
        sweeps,
        wide,
        drawing=RigDrawing(rig_id=head.rig_id, baseline_m=head.baseline_m),
        label=options.label or head.label,
        settings=_settings(options),
        session_id=session.id,
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
        distance=Distance(options.distance),
        compare=options.compare,
    )
