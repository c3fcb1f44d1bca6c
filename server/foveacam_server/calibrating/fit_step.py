"""Stages 2 and 3 fitted: a calibration from everything that a session measured, and how good it is."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import FoveaError, NotCalibrated
from foveacam_pipeline.calibrate.fit import session_fit
from foveacam_pipeline.calibrate.fit.fit import DOING
from foveacam_pipeline.calibrate.fit.fit_pictures import fit_pictures
from foveacam_pipeline.calibrate.fit.measured import DistanceSource, NominalRig
from foveacam_pipeline.calibrate.fit.session_fit import FitResult, FitSettings
from foveacam_pipeline.calibrate.sweep.sweep_file import load_sweep
from foveacam_pipeline.calibrate.watcher import ProcedureWatcher, raise_if_cancelled
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.content import content_id, plain
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_server.calibrating.documents import FIT
from foveacam_server.calibrating.finished import finish, finished
from foveacam_server.calibrating.fit_documents import fit_document
from foveacam_server.calibrating.options import FitOptions
from foveacam_server.calibrating.pictures import drawn, write_picture
from foveacam_server.calibrating.sessions import CalibrationSession
from foveacam_server.calibrating.step_environment import CalibrationRegistry, StepWatcher
from foveacam_server.calibrating.sweep_documents import sweep_paths
from foveacam_server.runtime.names import utc_now

STEP = "fit"
PICTURES = 6
"""How many a fit draws at most; its progress leaves room for them."""


def fit_session(
    session: CalibrationSession,
    options: FitOptions,
    wide: Intrinsics,
    *,
    registry: CalibrationRegistry,
    watch: StepWatcher,
) -> Calibration:
    """Fit, keep and return a calibration; its pictures are drawn as well.

    Cancelled before the last picture is drawn, nothing is kept of it; from then on everything is.
    """
    watch.stage(STEP)
    longer = _Longer(watch)
    result = fit_of(session, options, wide, watch=longer)
    pictures = _pictures(session, result, watch=longer)
    raise_if_cancelled(watch, doing=DOING)
    calibration = result.calibration
    registry.add(calibration)
    session.write(FIT, fit_document(result))
    for name, png in pictures.items():
        write_picture(session, name, png)
    session.add_calibration(calibration.id)
    finish(session, STEP, {"of": inputs_of(session, options, wide), "calibration_id": calibration.id})
    watch.fitted(calibration)
    watch.progress(longer.total, total=longer.total, note=f"calibration {calibration.id}")
    return calibration


def known_fit(
    session: CalibrationSession, options: FitOptions, wide: Intrinsics, *, registry: CalibrationRegistry
) -> Calibration | None:
    """Return the calibration that such a fit of these measurements has made already; None when none has."""
    how = finished(session, STEP)
    if how is None or how.get("of") != inputs_of(session, options, wide):
        return None
    try:
        return registry.get(str(how.get("calibration_id")))
    except FoveaError:
        return None  # deleted meanwhile


def inputs_of(session: CalibrationSession, options: FitOptions, wide: Intrinsics) -> str:
    """Return a name of all that a fit depends on; nodes visited again are left out, they only refine it."""
    sweeps = [load_sweep(path) for path in sweep_paths(session.folder)]
    told = options.model_dump() | {"label": options.label or session.head.label}
    poses = [[[pose.run, pose.t_ns] for pose in sweep.poses] for sweep in sweeps]
    return content_id(plain([told, wide, [sweep.header.station.name for sweep in sweeps], poses]))


class _Longer:
    """Passes a fit's progress on, with room for the pictures that are drawn after it."""

    def __init__(self, watch: ProcedureWatcher) -> None:
        self._watch = watch
        self.total = PICTURES

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        """Pass it on."""
        self.total = total + PICTURES
        self._watch.progress(done, total=self.total, note=note)

    def cancelled(self) -> bool:
        """Ask the watcher."""
        return self._watch.cancelled()

    def show(self, name: str, image: NDArray[np.uint8]) -> None:
        """Pass it on."""
        self._watch.show(name, image)


def _pictures(session: CalibrationSession, result: FitResult, *, watch: _Longer) -> dict[str, bytes]:
    """Draw everything, keep nothing yet."""
    pictures, fitted = {}, watch.total - PICTURES
    for number, (name, make) in enumerate(fit_pictures(result).items()):
        raise_if_cancelled(watch, doing=DOING)
        watch.progress(fitted + number, total=fitted, note="drawing")
        png = drawn(session, name, make)
        if png is not None:
            pictures[name] = png
    return pictures


def fit_of(
    session: CalibrationSession,
    options: FitOptions,
    wide: Intrinsics,
    *,
    watch: ProcedureWatcher | None = None,
) -> FitResult:
    """Return what can be fitted to the sweeps of a session; nothing is written.

    Raise Cancelled soon after `watch` wants no more.
    """
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
