"""Drift checks as jobs: one shot into the scene, written down, applied when it is sure and asked for."""

from pathlib import Path

from foveacam_pipeline.storage.disk import disk_errors
from foveacam_server.calibrating.drift_records import DriftRecords
from foveacam_server.runtime.calibration_job_watcher import CalibrationJobWatcher
from foveacam_server.runtime.calibration_runs import CalibrationJobTools
from foveacam_server.runtime.job_table import Job
from foveacam_server.runtime.jobs import JobContext
from foveacam_server.runtime.store import Document

KIND = "drift"
DRIFT_URL = "/api/v1/drift_checks"


class DriftChecks:
    """Queues checks, runs them, keeps what they found."""

    def __init__(self, folder: Path, equipment: CalibrationJobTools) -> None:
        self._folder = folder
        self.records = DriftRecords(folder)
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

    def _work(self, context: JobContext) -> str:
        from foveacam_server.calibrating.drift_step import check_drift, keep_check  # loads for a while

        wished = context.job.request
        watch = CalibrationJobWatcher(
            context, session_id=None, sink=self._with.sink, events=self._with.events, clock=self._with.clock
        )
        calibration = self._with.calibration.require()
        holder = f"drift check {context.job.id}"
        with self._with.hardware.session(holder, cancelled=context.cancelled) as head:
            found = check_drift(
                head,
                calibration,
                distance_m=wished.get("distance_m"),
                clock=self._with.clock,
                watch=watch,
            )
        with disk_errors("the drift check", self._folder):
            document = keep_check(
                found,
                calibration,
                apply=bool(wished.get("apply")),
                records=self.records,
                registry=self._with.calibration,
                watch=watch,
            )
        self._with.events.emit("calibration.drift", document["detail"], data=document)
        return f"{DRIFT_URL}/{document['id']}"
