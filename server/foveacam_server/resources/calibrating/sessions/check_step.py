"""The check step of a calibration session: measure the fitted calibration at gazes that no sweep visited."""

import math

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import NotCalibrated, StationTarget
from foveacam_pipeline.calibrate.fit.check import CheckResult, CheckSettings, check_calibration
from foveacam_pipeline.calibrate.fit.check_pictures import check_pictures
from foveacam_pipeline.calibrate.records.aggregate import sweep_paths
from foveacam_pipeline.calibrate.sweep.sweep_file import load_sweep
from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.foundation.quantities import rounded
from foveacam_server.resources.calibrating.sessions.options import CheckOptions
from foveacam_server.resources.calibrating.sessions.pictures import draw_pictures
from foveacam_server.resources.calibrating.sessions.schema import CheckDocument
from foveacam_server.resources.calibrating.sessions.sessions import (
    CHECK,
    CalibrationSession,
    FinishedCheck,
    FinishedSteps,
)
from foveacam_server.resources.calibrating.sessions.step_environment import (
    CalibrationRegistry,
    StepEnvironment,
    StepWatcher,
)
from foveacam_server.resources.calibrating.sessions.turning import turn_to_station

STEP = "check"
ASPECT = 4.0 / 3.0


def check_session(
    session: CalibrationSession,
    options: CheckOptions,
    *,
    environment: StepEnvironment,
    registry: CalibrationRegistry,
    watch: StepWatcher,
) -> CheckResult:
    """Measure the newest fit at gazes over the whole field, on the farthest markers, and store the result."""
    watch.stage(STEP)
    calibration = newest_calibration(session, registry)
    with environment.use("the check of a calibration") as rig:
        if rig.pan_tilt is not None and _has_markers(environment):
            station = environment.sweep_stations(None)[0]
            turn_to_station(
                rig.pan_tilt,
                station,
                clock=environment.clock,
                watch=watch,
                head=rig.head,
                wide=calibration.wide,
            )
        result = check_calibration(
            rig.head,
            calibration,
            clock=environment.clock,
            watch=watch,
            settings=_settings(options),
            swept_rad=_swept_rad(session),
        )
    session.write(CHECK, _describe(result))
    draw_pictures(session, check_pictures(result, calibration))
    session.finish_steps(FinishedSteps(check=_run_key(calibration, options)))
    return result


def is_checked(session: CalibrationSession, calibration: Calibration, options: CheckOptions) -> bool:
    """Return whether a check of this calibration with these options was completed."""
    return session.finished.check == _run_key(calibration, options)


def _run_key(calibration: Calibration, options: CheckOptions) -> FinishedCheck:
    return FinishedCheck(calibration_id=calibration.id, poses=options.poses)


def newest_calibration(session: CalibrationSession, registry: CalibrationRegistry) -> Calibration:
    """Return the session's newest calibration; raise `NotCalibrated` before the first fit."""
    fitted = session.head.calibrations
    if not fitted:
        raise NotCalibrated(
            f"session {session.id} holds no fitted calibration yet",
            asked="a check",
            found="no fitted calibration",
            remedy="run the step fit first",
        )
    return registry.get(fitted[-1])


def _describe(result: CheckResult) -> CheckDocument:
    return CheckDocument(
        calibration_id=result.calibration_id,
        epipolar_rms_px=rounded(result.epipolar_rms_px, 4),
        epipolar_p95_px=rounded(result.epipolar_p95_px, 4),
        pointing_rms_px=rounded(result.pointing_rms_px, 3),
        pointing_sigma_px=rounded(result.pointing_sigma_px, 3),
        poses=result.poses,
    )


def _settings(options: CheckOptions) -> CheckSettings:
    if options.poses is None:
        return CheckSettings()
    columns = max(2, round(math.sqrt(options.poses * ASPECT)))
    return CheckSettings(columns=columns, rows=max(2, math.ceil(options.poses / columns)))


def _swept_rad(session: CalibrationSession) -> NDArray[np.float64]:
    """Return the gazes of all swept poses: (n, 2) float64, rad."""
    nodes = [pose.node_rad for path in sweep_paths(session.folder) for pose in load_sweep(path).poses]
    return np.array(nodes, dtype=np.float64).reshape(-1, 2)


def _has_markers(environment: StepEnvironment) -> bool:
    return any(station.target is StationTarget.MARKERS for station in environment.stations)
