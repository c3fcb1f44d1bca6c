"""After a fit: what has drifted since the sweep is measured at some of its nodes, and taken out."""

import math
from dataclasses import replace

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.drift.check import check_drift_at_nodes
from foveacam_pipeline.calibrate.drift.correction import correct_calibration
from foveacam_pipeline.calibrate.drift.values import DriftCheck
from foveacam_pipeline.calibrate.fit.measured import DistanceSource
from foveacam_pipeline.calibrate.sweep.sweep import sweep_filename
from foveacam_pipeline.calibrate.sweep.sweep_file import load_sweep
from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.calibrating.documents import DRIFT
from foveacam_server.calibrating.drift_step import CORRECTED
from foveacam_server.calibrating.mirrors_step import revisit, sweep_settings, swept_stations
from foveacam_server.calibrating.options import FitOptions
from foveacam_server.calibrating.sessions import CalibrationSession
from foveacam_server.calibrating.step_environment import CalibrationRegistry, StepEnvironment, StepWatcher
from foveacam_server.runtime.documents import deg
from foveacam_server.runtime.names import utc_now
from foveacam_server.runtime.store import Document


def close_drift(
    session: CalibrationSession,
    calibration: Calibration,
    options: FitOptions,
    *,
    workplace: StepEnvironment,
    registry: CalibrationRegistry,
    watch: StepWatcher,
) -> Calibration:
    """Look at nodes of the first station again and return the calibration as it is right now.

    `options`: those it was fitted with. Where nothing has moved, nobody turns the rig for it, or too few
    nodes were seen, it comes back as it was; the session says which.
    """
    watch.stage("check")
    if DistanceSource(options.distance) is DistanceSource.UNKNOWN:
        return calibration  # its angles count from elsewhere
    with workplace.use("asking the pan-tilt") as hands:
        if hands.pan_tilt is None or not hands.pan_tilt.moves_itself:
            return calibration
    stations = swept_stations(session, workplace)
    settings = sweep_settings(workplace)
    visits = revisit(
        session, stations[0], calibration.wide, workplace=workplace, watch=watch, settings=settings
    )
    used = stations if options.use_all_distances else stations[:1]
    sweeps = [load_sweep(session.folder / sweep_filename(station)) for station in used]
    found = check_drift_at_nodes(sweeps, visits, calibration, distance=DistanceSource(options.distance))
    corrected = _corrected(calibration, found)
    session.write(DRIFT, closing_document(found, corrected, f_px=calibration.fovea_f_px))
    if corrected.id != calibration.id:
        registry.add(corrected)
        session.add_calibration(corrected.id)
        watch.fitted(corrected)
    return corrected


def _corrected(calibration: Calibration, found: DriftCheck) -> Calibration:
    if not (found.locked and found.significant):
        return calibration
    created_utc = utc_now().replace("Z", "+00:00")
    corrected = correct_calibration(calibration, found, created_utc=created_utc)
    return replace(corrected, label=calibration.label.removesuffix(CORRECTED) + CORRECTED)


def closing_document(found: DriftCheck, corrected: Calibration, *, f_px: float) -> Document:
    """Return what had drifted between the sweep and the check as REST shows it."""
    return {
        "calibration_id": corrected.id,
        "corrected": corrected.id != found.calibration_id,
        "places": len(found.places),
        "eyes": [
            {
                "eye": role.value,
                "shift_deg": [deg(angle) for angle in found.eye(role).turn.shift_rad],
                "roll_deg": deg(found.eye(role).turn.turn_rad[2]),
                "moved_px": round(found.eye(role).moved_px, 3),
                "sigma_px": round(found.eye(role).sigma_px, 3),
            }
            for role in (Role.LEFT, Role.RIGHT)
        ],
        "rows_px": round(f_px * _rows_rad(found), 3),
        "detail": found.detail,
    }


def _rows_rad(found: DriftCheck) -> float:
    """Return by how much the eyes' rows had come apart."""
    return math.fabs(found.left.turn.shift_rad[1] - found.right.turn.shift_rad[1])
