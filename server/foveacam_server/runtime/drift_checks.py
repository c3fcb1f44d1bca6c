"""Drift checks as jobs: one shot into the scene, written down, applied when it is sure and asked for."""

from dataclasses import replace
from pathlib import Path

from foveacam_server.calibrating.drift_records import DriftRecords, drift_document
from foveacam_server.runtime.calibration_runs import Equipment
from foveacam_server.runtime.calibration_watch import JobWatch
from foveacam_server.runtime.job_table import Job
from foveacam_server.runtime.jobs import JobContext
from foveacam_server.runtime.names import new_id, utc_now
from foveacam_server.runtime.store import Document

KIND = "drift"
DRIFT_URL = "/api/v1/drift_checks"
CORRECTED = ", corrected for drift"


class DriftChecks:
    """Queues checks, runs them, keeps what they found."""

    def __init__(self, folder: Path, equipment: Equipment) -> None:
        self.records = DriftRecords(folder=folder)
        self._with = equipment
        equipment.jobs.handle(KIND, self._work)

    def submit(self, request: Document, *, idempotency_key: str | None = None) -> Job:
        """Queue a check; refuse at once what could not be done now."""
        self._with.calibration.require()
        self._with.hardware.check_may_move()
        return self._with.jobs.submit(KIND, request, idempotency_key=idempotency_key)

    def at_url(self, url: str) -> Document:
        """Return the check that a job's result URL names."""
        return self.records.get(url.rsplit("/", 1)[1])

    def trend(self) -> bytes:
        """Return a PNG of the drift over time."""
        from foveacam_server.calibrating.drift_trend import trend_picture  # figures load for seconds

        return trend_picture(self.records)

    def _work(self, context: JobContext) -> str:
        from foveacam_pipeline.calibrate.drift import applied, one_shot
        from foveacam_pipeline.calibrate.drift_values import DriftSettings

        wished = context.job.request
        calibration = self._with.calibration.require()
        watch = JobWatch(
            context, session_id=None, sink=self._with.sink, events=self._with.events, clock=self._with.clock
        )
        watch.stage("drift")
        settings = DriftSettings(distance_m=wished.get("distance_m"))
        hardware = self._with.hardware
        with hardware.session(f"drift check {context.job.id}", cancelled=context.cancelled) as head:
            found = one_shot(head, calibration, clock=self._with.clock, watch=watch, settings=settings)
        created_utc = utc_now()
        new = None
        if wished.get("apply") and found.locked and found.significant:
            new = applied(calibration, found, created_utc=created_utc.replace("Z", "+00:00"))
            new = replace(new, label=calibration.label.removesuffix(CORRECTED) + CORRECTED)
            self._with.calibration.add(new)
            self._with.calibration.activate(new.id)
            watch.fitted(new)
        document = drift_document(
            found,
            check_id=new_id("drf"),
            created_utc=created_utc,
            new_calibration_id=None if new is None else new.id,
        )
        self.records.add(document)
        self._with.events.emit("calibration.drift", found.detail, data=document)
        return f"{DRIFT_URL}/{document['id']}"
