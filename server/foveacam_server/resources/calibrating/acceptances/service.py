"""Runs acceptance as a job on the server's rig, and stores what it finds."""

from pathlib import Path

from foveacam_hardware.contract import Stopped
from foveacam_pipeline.storage.disk import disk_errors
from foveacam_server.foundation.job_table import Job
from foveacam_server.foundation.jobs import JobContext
from foveacam_server.foundation.names import utc_now
from foveacam_server.resources.calibrating.acceptances.records import AcceptanceRecords
from foveacam_server.resources.calibrating.acceptances.schema import AcceptanceEnded, AcceptanceRequest
from foveacam_server.resources.calibrating.sessions.job_watcher import CalibrationJobWatcher
from foveacam_server.resources.calibrating.sessions.runs import CalibrationJobTools
from foveacam_server.rig import refusals

KIND = "acceptance"
ACCEPTANCES_URL = "/api/v1/acceptances"


class Acceptances:
    """Queues and runs acceptance runs and stores their results."""

    def __init__(self, folder: Path, tools: CalibrationJobTools) -> None:
        self.records = AcceptanceRecords(folder)
        self._tools = tools
        tools.jobs.handle(KIND, self._work)

    def submit(self, request: AcceptanceRequest, *, idempotency_key: str | None = None) -> Job:
        """Queue a run; raise at once while no rig is open or the stop is engaged."""
        self._tools.hardware.check_open()
        if self._tools.hardware.halted:
            raise refusals.stopped()
        return self._tools.jobs.submit(KIND, request, idempotency_key=idempotency_key)

    def _work(self, context: JobContext) -> str:
        from foveacam_pipeline.accept.environment import AcceptanceOptions
        from foveacam_pipeline.accept.run import run_acceptance  # fits load slowly
        from foveacam_server.resources.calibrating.acceptances.environment import environment_of_server

        request = context.job.parse_request(AcceptanceRequest)
        tools = self._tools
        watch = CalibrationJobWatcher(
            context, session_id=None, sink=tools.sink, events=tools.events, clock=tools.clock
        )
        watch.stage(KIND)
        calibration = tools.calibration.current
        environment = environment_of_server(
            tools.hardware,
            calibration,
            holder=f"acceptance {context.job.id}",
            clock=tools.clock,
            cancelled=watch.cancelled,
        )
        found = run_acceptance(
            environment,
            begun_utc=utc_now().replace("Z", "+00:00"),
            watch=watch,
            options=AcceptanceOptions(looks=request.looks, wide_s=request.wide_s),
        )
        with disk_errors("the acceptance run", self.records.folder):
            document = self.records.add(found, calibration)
        ended = AcceptanceEnded(
            id=document.id,
            accepted=document.accepted,
            faults=[named.fault for named in document.findings],
        )
        tools.events.emit("calibration.acceptance", document.summary, data=ended)
        if not document.complete:
            context.check()  # cancelled: what was measured is kept
            raise Stopped(
                "the acceptance run was stopped, and what was measured until then is kept",
                remedy="release the stop, and run it again",
            )
        return f"{ACCEPTANCES_URL}/{document.id}"
