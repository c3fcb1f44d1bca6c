"""One drift check: looks, says what it found, and corrects the calibration when that is sure."""

from dataclasses import replace

from foveacam_hardware.contract import Clock, Head
from foveacam_pipeline.calibrate.drift.check import run_drift_check
from foveacam_pipeline.calibrate.drift.correction import correct_calibration
from foveacam_pipeline.calibrate.drift.values import DriftCheck, DriftSettings
from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.calibrating.drift_records import DriftRecords
from foveacam_server.calibrating.step_environment import CalibrationRegistry, StepWatcher
from foveacam_server.runtime.names import utc_now
from foveacam_server.runtime.store import Document

CORRECTED = ", corrected for drift"


def check_drift(
    head: Head,
    calibration: Calibration,
    *,
    distance_m: float | None,
    clock: Clock,
    watch: StepWatcher,
) -> DriftCheck:
    """Return how far the eyes have moved; `distance_m`: of what stands in the middle, when known."""
    watch.stage("drift")
    settings = DriftSettings(distance_m=distance_m)
    return run_drift_check(head, calibration, clock=clock, watch=watch, settings=settings)


def keep_check(
    found: DriftCheck,
    calibration: Calibration,
    *,
    apply: bool,
    records: DriftRecords,
    registry: CalibrationRegistry,
    watch: StepWatcher,
) -> Document:
    """Write a check down; with `apply`, correct a drift that is surely there and put the result in force."""
    created_utc = utc_now().replace("Z", "+00:00")
    corrected = None
    if apply and found.locked and found.significant:
        corrected = correct_calibration(calibration, found, created_utc=created_utc)
        corrected = replace(corrected, label=calibration.label.removesuffix(CORRECTED) + CORRECTED)
        registry.add(corrected)
    new_id = None if corrected is None else corrected.id
    document = records.add(found, created_utc=created_utc, new_calibration_id=new_id)
    if corrected is not None:  # last: a disk that takes no more changes nothing that is in force
        registry.activate(corrected.id)
        watch.fitted(corrected)
    return document
