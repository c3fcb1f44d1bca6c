"""Measure the drift of the eyes since a calibration from looks into any scene, and correct it on request."""

from foveacam_hardware.contract import Clock, Head
from foveacam_pipeline.calibrate.drift.check import run_drift_check
from foveacam_pipeline.calibrate.drift.values import DriftCheck, DriftSettings
from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.foundation.names import utc_now
from foveacam_server.resources.calibrating.drift_checks.records import DriftRecords
from foveacam_server.resources.calibrating.drift_checks.schema import DriftCheckDocument
from foveacam_server.resources.calibrating.sessions.drift_step import corrected_for_drift
from foveacam_server.resources.calibrating.sessions.step_environment import (
    CalibrationRegistry,
    StepWatcher,
)


def check_drift(
    head: Head,
    calibration: Calibration,
    *,
    distance_m: float | None,
    clock: Clock,
    watch: StepWatcher,
) -> DriftCheck:
    """Return the eyes' drift; `distance_m`: to the scene's centre, when known."""
    watch.stage("drift")
    settings = DriftSettings(distance_m=distance_m)
    return run_drift_check(head, calibration, clock=clock, watch=watch, settings=settings)


def store_check(
    found: DriftCheck,
    calibration: Calibration,
    *,
    apply: bool,
    records: DriftRecords,
    registry: CalibrationRegistry,
    watch: StepWatcher,
) -> DriftCheckDocument:
    """Store a check; with `apply`, correct a significant drift and put the corrected calibration in force."""
    created_utc = utc_now().replace("Z", "+00:00")
    corrected = None
    if apply and found.locked and found.significant:
        corrected = corrected_for_drift(calibration, found, created_utc=created_utc)
        registry.add(corrected)
    new_id = None if corrected is None else corrected.id
    stored = records.add(found, created_utc=created_utc, new_calibration_id=new_id)
    if corrected is not None:  # last, so that a full disk changes nothing that is in force
        registry.activate(corrected.id)
        watch.fitted(corrected)
    return stored
