"""Correct a new calibration for the drift since its sweep: return to nodes of the first station."""

import math
from dataclasses import replace

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.drift.check import check_drift_at_nodes
from foveacam_pipeline.calibrate.drift.correction import correct_calibration
from foveacam_pipeline.calibrate.drift.values import DriftCheck, EyeDrift
from foveacam_pipeline.calibrate.fit.measured import DistanceSource
from foveacam_pipeline.calibrate.sweep.sweep import sweep_filename
from foveacam_pipeline.calibrate.sweep.sweep_file import load_sweep
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.aim import EYES
from foveacam_server.foundation.names import utc_now
from foveacam_server.foundation.quantities import deg
from foveacam_server.resources.calibrating.sessions.mirrors_step import (
    measure_nodes_again,
    sweep_settings,
    swept_stations,
)
from foveacam_server.resources.calibrating.sessions.options import FitOptions
from foveacam_server.resources.calibrating.sessions.schema import (
    ClosingDocument,
    ClosingEyeDocument,
    eye_of,
)
from foveacam_server.resources.calibrating.sessions.sessions import DRIFT, CalibrationSession
from foveacam_server.resources.calibrating.sessions.step_environment import (
    CalibrationRegistry,
    StepEnvironment,
    StepWatcher,
)

CORRECTED = ", corrected for drift"


def close_drift(
    session: CalibrationSession,
    calibration: Calibration,
    options: FitOptions,
    *,
    environment: StepEnvironment,
    registry: CalibrationRegistry,
    watch: StepWatcher,
) -> Calibration:
    """Measure nodes of the first station again and return the calibration corrected for the drift since.

    `options`: those of the fit. The calibration is returned unchanged where the drift is not significant, no
    motor turns the rig, or too few nodes were seen; the session's drift result gives the reason.
    """
    watch.stage("check")
    if DistanceSource(options.distance) is DistanceSource.UNKNOWN:
        return calibration  # its angles have an unknown origin
    with environment.use("asking the pan-tilt") as rig:
        if rig.pan_tilt is None or not rig.pan_tilt.moves_itself:
            return calibration
    stations = swept_stations(session, environment)
    settings = sweep_settings(environment)
    visits = measure_nodes_again(
        session, stations[0], calibration.wide, environment=environment, watch=watch, settings=settings
    )
    used = stations if options.use_all_distances else stations[:1]
    sweeps = [load_sweep(session.folder / sweep_filename(station)) for station in used]
    found = check_drift_at_nodes(sweeps, visits, calibration, distance=DistanceSource(options.distance))
    corrected = calibration
    if found.locked and found.significant:
        created_utc = utc_now().replace("Z", "+00:00")
        corrected = corrected_for_drift(calibration, found, created_utc=created_utc)
    session.write(DRIFT, _describe(found, corrected, f_px=calibration.fovea_f_px))
    if corrected.id != calibration.id:
        registry.add(corrected)
        session.add_calibration(corrected.id)
        watch.fitted(corrected)
    return corrected


def corrected_for_drift(calibration: Calibration, found: DriftCheck, *, created_utc: str) -> Calibration:
    """Return the calibration corrected for a drift, with a label that states it."""
    corrected = correct_calibration(calibration, found, created_utc=created_utc)
    return replace(corrected, label=calibration.label.removesuffix(CORRECTED) + CORRECTED)


def _describe(found: DriftCheck, corrected: Calibration, *, f_px: float) -> ClosingDocument:
    rows_rad = math.fabs(found.left.turn.shift_rad[1] - found.right.turn.shift_rad[1])
    return ClosingDocument(
        calibration_id=corrected.id,
        corrected=corrected.id != found.calibration_id,
        places=len(found.places),
        eyes=[_eye(role, found.eye(role)) for role in EYES],
        rows_px=round(f_px * rows_rad, 3),
        detail=found.detail,
    )


def _eye(role: Role, drift: EyeDrift) -> ClosingEyeDocument:
    across_rad, down_rad = drift.turn.shift_rad
    return ClosingEyeDocument(
        eye=eye_of(role),
        shift_deg=(deg(across_rad), deg(down_rad)),
        roll_deg=deg(drift.turn.turn_rad[2]),
        moved_px=round(drift.moved_px, 3),
        sigma_px=round(drift.sigma_px, 3),
    )
