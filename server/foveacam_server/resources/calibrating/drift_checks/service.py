"""Runs drift checks as jobs: a few looks into the scene, the result stored, and applied on request."""

from pathlib import Path

from foveacam_pipeline.storage.disk import disk_errors
from foveacam_server.foundation.job_table import Job
from foveacam_server.foundation.jobs import JobContext
from foveacam_server.resources.calibrating.drift_checks.records import DriftRecords
from foveacam_server.resources.calibrating.drift_checks.schema import DriftRequest
from foveacam_server.resources.calibrating.sessions.job_watcher import CalibrationJobWatcher
from foveacam_server.resources.calibrating.sessions.runs import CalibrationJobTools

KIND = "drift"
DRIFT_URL = "/api/v1/drift_checks"


class DriftChecks:
    """Queues and runs checks and stores their results."""

    def __init__(self, folder: Path, tools: CalibrationJobTools) -> None:
        self._folder = folder
        self.records = DriftRecords(folder)
        self._tools = tools
        tools.jobs.handle(KIND, self._work)

    def submit(self, request: DriftRequest, *, idempotency_key: str | None = None) -> Job:
        """Queue a check; raise at once where it cannot run now."""
        self._tools.calibration.require()
        self._tools.hardware.check_may_move()
        return self._tools.jobs.submit(KIND, request, idempotency_key=idempotency_key)

    def _work(self, context: JobContext) -> str:
        from foveacam_server.resources.calibrating.drift_checks.step import (  # slow to import
            check_drift,
            store_check,
        )

        request = context.job.parse_request(DriftRequest)
        watch = CalibrationJobWatcher(
            context,
            session_id=None,
            sink=self._tools.sink,
            events=self._tools.events,
            clock=self._tools.clock,
        )
        calibration = self._tools.calibration.require()
        holder = f"drift check {context.job.id}"
        with self._tools.hardware.session(holder, cancelled=context.cancelled) as head:
            found = check_drift(
                head,
                calibration,
                distance_m=request.distance_m,
                clock=self._tools.clock,
                watch=watch,
            )
        with disk_errors("the drift check", self._folder):
            stored = store_check(
                found,
                calibration,
                apply=request.apply,
                records=self.records,
                registry=self._tools.calibration,
                watch=watch,
            )
        self._tools.events.emit("calibration.drift", stored.detail, data=stored)
        return f"{DRIFT_URL}/{stored.id}"
