"""One drift check: looks, says what it found, and corrects the calibration when that is sure."""

from dataclasses import replace

from foveacam_hardware.contract import Clock, Head
from foveacam_pipeline.calibrate.drift import applied, one_shot
from foveacam_pipeline.calibrate.drift_values import DriftSettings
from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.calibrating.drift_records import DriftRecords, drift_document
from foveacam_server.calibrating.workplace import Registry, StepWatcher
from foveacam_server.runtime.names import new_id, utc_now
from foveacam_server.runtime.store import Document

CORRECTED = ", corrected for drift"


def check_drift(
    head: Head,
    calibration: Calibration,
    *,
    distance_m: float | None,
    clock: Clock,
    watch: StepWatcher,
) -> tuple[Document, Calibration | None]:
    """Return what a check found, and the corrected calibration where there is something to correct."""
    watch.stage("drift")
    settings = DriftSettings(distance_m=distance_m)
    found = one_shot(head, calibration, clock=clock, watch=watch, settings=settings)
    created_utc = utc_now()
    new = None
    if found.locked and found.significant:
        new = applied(calibration, found, created_utc=created_utc.replace("Z", "+00:00"))
        new = replace(new, label=calibration.label.removesuffix(CORRECTED) + CORRECTED)
    document = drift_document(found, check_id=new_id("drf"), created_utc=created_utc)
    return document, new


def keep_check(
    document: Document,
    corrected: Calibration | None,
    *,
    records: DriftRecords,
    registry: Registry,
    watch: StepWatcher,
) -> Document:
    """Put the corrected calibration in force, if there is one, and write the check down."""
    if corrected is not None:
        registry.add(corrected)
        registry.activate(corrected.id)
        watch.fitted(corrected)
        document = document | {"applied": True, "new_calibration_id": corrected.id}
    records.add(document)
    return document
