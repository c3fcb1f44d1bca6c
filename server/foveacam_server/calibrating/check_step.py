"""The check as a step of a session: the fitted calibration at places that no sweep visited."""

import math

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import NotCalibrated, StationTarget
from foveacam_pipeline.calibrate.fit.check import CheckResult, CheckSettings, check_calibration
from foveacam_pipeline.calibrate.fit.check_pictures import check_pictures
from foveacam_pipeline.calibrate.sweep.sweep_file import load_sweep
from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.calibrating.documents import CHECK
from foveacam_server.calibrating.finished import finish, finished
from foveacam_server.calibrating.options import CheckOptions
from foveacam_server.calibrating.pictures import draw
from foveacam_server.calibrating.sessions import CalibrationSession
from foveacam_server.calibrating.step_environment import CalibrationRegistry, StepEnvironment, StepWatcher
from foveacam_server.calibrating.sweep_documents import sweep_paths
from foveacam_server.calibrating.turning import turn_to_station
from foveacam_server.runtime.documents import rounded
from foveacam_server.runtime.store import Document

STEP = "check"
ASPECT = 4.0 / 3.0


def check_session(
    session: CalibrationSession,
    options: CheckOptions,
    *,
    workplace: StepEnvironment,
    registry: CalibrationRegistry,
    watch: StepWatcher,
) -> CheckResult:
    """Look, over the farthest markers, at places all over the field, and keep what was found."""
    watch.stage(STEP)
    calibration = newest_of(session, registry)
    with workplace.use("the check of a calibration") as hands:
        if hands.pan_tilt is not None and _has_markers(workplace):
            station = workplace.sweep_stations(None)[0]
            turn_to_station(
                hands.pan_tilt,
                station,
                clock=workplace.clock,
                watch=watch,
                head=hands.head,
                wide=calibration.wide,
            )
        result = check_calibration(
            hands.head,
            calibration,
            clock=workplace.clock,
            watch=watch,
            settings=_settings(options),
            swept_rad=_swept_rad(session),
        )
    session.write(CHECK, check_document(result))
    draw(session, check_pictures(result, calibration))
    finish(session, STEP, _told(calibration, options))
    return result


def is_checked(session: CalibrationSession, calibration: Calibration, options: CheckOptions) -> bool:
    """Tell whether such a check of this calibration came to its end."""
    return finished(session, STEP) == _told(calibration, options)


def _told(calibration: Calibration, options: CheckOptions) -> Document:
    return {"calibration_id": calibration.id, **options.model_dump()}


def newest_of(session: CalibrationSession, registry: CalibrationRegistry) -> Calibration:
    """Return the calibration that was fitted last; raise `NotCalibrated` before the first."""
    fitted = session.head.calibrations
    if not fitted:
        raise NotCalibrated(
            f"session {session.id} holds no fitted calibration yet; run the step fit first",
            asked="a check",
            found="no fitted calibration",
            remedy="run the step fit first",
        )
    return registry.get(fitted[-1])


def check_document(result: CheckResult) -> Document:
    """Return a check as REST shows it."""
    return {
        "calibration_id": result.calibration_id,
        "epipolar_rms_px": rounded(result.epipolar_rms_px, 4),
        "epipolar_p95_px": rounded(result.epipolar_p95_px, 4),
        "pointing_rms_px": rounded(result.pointing_rms_px, 3),
        "pointing_sigma_px": rounded(result.pointing_sigma_px, 3),
        "poses": result.poses,
    }


def _settings(options: CheckOptions) -> CheckSettings:
    if options.poses is None:
        return CheckSettings()
    columns = max(2, round(math.sqrt(options.poses * ASPECT)))
    return CheckSettings(columns=columns, rows=max(2, math.ceil(options.poses / columns)))


def _swept_rad(session: CalibrationSession) -> NDArray[np.float64]:
    """Return the (n, 2) gazes of every pose that was swept."""
    nodes = [pose.node_rad for path in sweep_paths(session.folder) for pose in load_sweep(path).poses]
    return np.array(nodes, dtype=np.float64).reshape(-1, 2)


def _has_markers(workplace: StepEnvironment) -> bool:
    return any(station.target is StationTarget.MARKERS for station in workplace.stations)
