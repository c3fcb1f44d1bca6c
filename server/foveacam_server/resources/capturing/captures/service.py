"""Runs captures as jobs (start, pause, continue, resume), one at a time: each needs the rig exclusively."""

import threading
from pathlib import Path

from pydantic import TypeAdapter

from foveacam_hardware.contract import Busy
from foveacam_pipeline.capture.dataset import ImageCodec
from foveacam_pipeline.capture.dataset.labels import change_labels
from foveacam_pipeline.capture.run import PaceMeter, known_directions, measure_distances_m
from foveacam_server.datasets.capture_paces import CapturePaces
from foveacam_server.datasets.capture_tools import CaptureRigFacts, CaptureTools, rig_facts
from foveacam_server.datasets.collection import CAPTURES_URL, DatasetCollection, StoredCapture
from foveacam_server.foundation.job_table import Job
from foveacam_server.foundation.jobs import JobContext
from foveacam_server.resources.capturing.captures.begin import (
    CaptureSpec,
    begin_dataset,
    check_remaining_room,
    check_resumable,
    check_room,
    resume_dataset,
)
from foveacam_server.resources.capturing.captures.estimates import PlanToEstimate, check_possible
from foveacam_server.resources.capturing.captures.job_watcher import CaptureJobWatcher, LiveCapture
from foveacam_server.resources.capturing.captures.schema import (
    CaptureDocument,
    CaptureEvent,
    CapturePatch,
    CaptureProgress,
    CaptureRequest,
    CaptureResumption,
    EstimateRequest,
)
from foveacam_server.resources.capturing.captures.timed_run import run_timed
from foveacam_server.rig import refusals
from foveacam_server.rig.access import ThreadAccess
from foveacam_server.rig.hardware_commands import answer_of

KIND = "capture"
ID_PREFIX = "cap-"
_JOB_REQUEST: TypeAdapter[CaptureRequest | CaptureResumption] = TypeAdapter(
    CaptureRequest | CaptureResumption
)


class CaptureService:
    """The captures of this data directory: run, list, change, remove."""

    def __init__(self, folder: Path, tools: CaptureTools) -> None:
        self.collection = DatasetCollection(folder)
        self._tools = tools
        self._paces = CapturePaces(folder)
        self._lock = threading.Lock()
        self._live: LiveCapture | None = None
        tools.jobs.handle(KIND, self._work)

    # Capturing ---------------------------------------------------------------------------------------------

    def start(self, request: CaptureRequest, *, idempotency_key: str | None = None) -> Job:
        """Queue a capture; raise at once where it cannot be made now."""
        if self._tools.jobs.has_key(idempotency_key):
            return self._tools.jobs.submit(KIND, request, idempotency_key=idempotency_key)
        with self._lock:
            self._check_free("begin a capture")
            folder = self.collection.new_folder(request.name)
            plan, calibration = request.plan, self._tools.calibration.require()
            facts = self._facts()
            self._tools.hardware.check_may_move()
            check_possible(plan, calibration, facts)
            check_room(plan, facts, calibration, codec=ImageCodec(request.codec), folder=folder.parent)
            job = self._tools.jobs.submit(KIND, request, idempotency_key=idempotency_key)
            self._live = LiveCapture(id=_capture_id(job), name=folder.name, job_id=job.id)
        event = CaptureEvent(capture_id=self._live.id)
        self._tools.events.emit("capture.created", f"capture {folder.name} was asked for", data=event)
        return job

    def resume(self, capture_id: str, *, idempotency_key: str | None = None) -> Job:
        """Queue the rest of a capture that was interrupted or cancelled."""
        request = CaptureResumption(capture_id=capture_id)
        if self._tools.jobs.has_key(idempotency_key):
            return self._tools.jobs.submit(KIND, request, idempotency_key=idempotency_key)
        with self._lock:
            self._check_free("resume a capture")
            kept = self.collection.get(capture_id)
            check_resumable(kept)
            self._tools.hardware.check_may_move()
            check_remaining_room(kept.folder, self._facts())
            job = self._tools.jobs.submit(KIND, request, idempotency_key=idempotency_key)
            self._live = LiveCapture(id=capture_id, name=kept.name, job_id=job.id)
        return job

    def pause(self, capture_id: str) -> CaptureDocument:
        """Pause a running capture after its next point, if it is not paused."""
        live = self._running(capture_id, "pause")
        live.pausing.set()
        return self.get(capture_id)

    def go_on(self, capture_id: str) -> CaptureDocument:
        """Continue a paused capture, if it is paused."""
        live = self._running(capture_id, "let go on")
        live.pausing.clear()
        return self.get(capture_id)

    def plan_to_estimate(self, request: EstimateRequest) -> PlanToEstimate:
        """Return a plan with the rig's properties for its estimate, at `distance_m` if the plan has none."""
        calibration = self._tools.calibration.require()
        return PlanToEstimate(
            plan=request.plan,
            calibration=calibration,
            facts=self._facts(),
            runs=self._paces.of(calibration.rig_id),
            codec=ImageCodec(request.codec),
            assumed_m=request.distance_m or self._tools.distance_m(),
            folder=self.collection.folder,
            known=known_directions(request.plan, calibration, self._tools.context),
        )

    # Captures on the disk ----------------------------------------------------------------------------------

    def search(self, *, text: str = "", removed: bool = False) -> list[CaptureDocument]:
        """Return captures whose name, label, id or state contains all words of `text`, newest first.

        `removed`: those in the trash instead.
        """
        if removed:
            found = [CaptureDocument.of(kept) for kept in self.collection.trash()]
        else:
            found = [self._shown(kept) for kept in self.collection.every()]
            live = self._current()
            if live is not None and all(known.id != live.id for known in found):
                found.insert(0, self._not_begun(live))
        words = text.casefold().split()
        return [known for known in found if all(word in _searched(known) for word in words)]

    def get(self, capture_id: str) -> CaptureDocument:
        """Return a capture by its id or raise NotFound."""
        live = self._current()
        begun = any(kept.id == capture_id for kept in self.collection.every())
        if live is not None and live.id == capture_id and not begun:
            return self._not_begun(live)
        return self._shown(self.collection.get(capture_id))

    def is_running(self, capture_id: str) -> bool:
        """Return whether a job for the capture runs or is queued."""
        live = self._current()
        return live is not None and live.id == capture_id

    def edit(self, capture_id: str, change: CapturePatch) -> CaptureDocument:
        """Change label or licence; raise while the capture is being written."""
        change_labels(self.collection.get(capture_id).folder, label=change.label, licence=change.licence)
        self.report_update(capture_id, "label or licence of a capture was changed")
        return self.get(capture_id)

    def report_update(self, capture_id: str, message: str) -> None:
        """Emit that a capture was changed."""
        self._tools.events.emit("capture.updated", message, data=CaptureEvent(capture_id=capture_id))

    def remove(self, capture_id: str) -> None:
        """Move a capture to the trash; raise `Busy` while it runs."""
        live = self._current()
        if live is not None and live.id == capture_id:
            raise refusals.in_use(f"remove capture {live.name}", f"capture {live.name}")
        kept = self.collection.remove(capture_id)
        event = CaptureEvent(capture_id=capture_id, name=kept.name)
        self._tools.events.emit("capture.removed", f"capture {kept.name} is in the trash", data=event)

    def restore(self, capture_id: str) -> CaptureDocument:
        """Restore a capture from the trash."""
        kept = self.collection.restore(capture_id)
        self.report_update(kept.id, f"capture {kept.name} is out of the trash")
        return self.get(kept.id)

    # The job -----------------------------------------------------------------------------------------------

    def _work(self, context: JobContext) -> str:
        tools, live = self._tools, self._live_of(context.job)
        request = _JOB_REQUEST.validate_python(context.job.request, strict=False)
        watch = CaptureJobWatcher(
            context, live, sink=tools.sink, overlay=tools.overlay, events=tools.events, clock=tools.clock
        )
        meter = PaceMeter(watch, clock=tools.clock)
        holder = f"capture {live.name}"
        try:
            measured_m = self._survey(request, holder, meter)
            with tools.hardware.session(holder, cancelled=context.cancelled, binning=1) as head:
                access = ThreadAccess(tools.hardware, head, clock=tools.clock)
                if isinstance(request, CaptureResumption):
                    writer = resume_dataset(access, self.collection.get(live.id).folder)
                else:
                    folder = self.collection.new_folder(request.name)
                    spec = _spec_of(request, live.id)
                    calibration = tools.calibration.require()
                    writer = begin_dataset(
                        access, folder, spec, calibration, watch=meter, measured_m=measured_m
                    )
                with writer:
                    run_timed(access, writer, meter, self._paces)
        finally:
            with self._lock:
                self._live = None
            self._emit_end(live)
        return f"{CAPTURES_URL}/{live.id}"

    def _survey(
        self, request: CaptureRequest | CaptureResumption, holder: str, watch: PaceMeter
    ) -> tuple[float | None, ...]:
        """Return the distances that a plan needs, m; measured at the working binning, which is faster."""
        tools = self._tools
        if isinstance(request, CaptureResumption) or not request.plan.needs_distance:
            return ()
        with tools.hardware.session(holder, cancelled=watch.cancelled) as head:
            access = ThreadAccess(tools.hardware, head, clock=tools.clock)
            calibration = tools.calibration.require()
            return measure_distances_m(access, request.plan, calibration, watch=watch, context=tools.context)

    def _facts(self) -> CaptureRigFacts:
        return answer_of(self._tools.hardware.submit(rig_facts), asked="the rig's settings")

    def _check_free(self, asked: str) -> None:
        live = self._current()
        holder = f"capture {live.name}" if live is not None else self._tools.hardware.use.holder
        if holder is not None:
            raise refusals.in_use(asked, holder)

    def _current(self) -> LiveCapture | None:
        """Return the queued or running capture; None also after its job was cancelled while queued."""
        live = self._live
        if live is None or self._tools.jobs.get(live.job_id).state.ended:
            return None
        return live

    def _live_of(self, job: Job) -> LiveCapture:
        with self._lock:
            live = self._live
        if live is None or live.job_id != job.id:
            raise AssertionError("a capture is queued under the lock that it is known by")
        return live

    def _running(self, capture_id: str, asked: str) -> LiveCapture:
        live = self._current()
        if live is None or live.id != capture_id:
            kept = self.collection.get(capture_id)
            raise Busy(
                f"asked to {asked} capture {kept.name}: it does not run",
                asked=f"{asked} capture {kept.name}",
                found="it does not run",
                remedy="resume it, if it is partial",
            )
        return live

    def _shown(self, kept: StoredCapture) -> CaptureDocument:
        return _with_live(CaptureDocument.of(kept), self._current())

    def _not_begun(self, live: LiveCapture) -> CaptureDocument:
        empty = StoredCapture(id=live.id, folder=self.collection.folder / live.name, dataset=None)
        return _with_live(CaptureDocument.of(empty), live)

    def _emit_end(self, live: LiveCapture) -> None:
        found = next((kept for kept in self.collection.every() if kept.id == live.id), None)
        if found is None:
            event = CaptureEvent(capture_id=live.id)
            self._tools.events.emit(
                "capture.ended", f"capture {live.name} ended before its first point", data=event
            )
            return
        ended = CaptureDocument.of(found)
        message = f"capture {live.name} is {ended.state}" + (f": {ended.why}" if ended.why else "")
        event = CaptureEvent(capture_id=live.id, state=ended.state, why=ended.why)
        self._tools.events.emit("capture.ended", message, data=event)


def _spec_of(request: CaptureRequest, capture_id: str) -> CaptureSpec:
    return CaptureSpec(
        plan=request.plan,
        label=request.label,
        licence=request.licence,
        codec=ImageCodec(request.codec),
        capture_id=capture_id,
    )


def _capture_id(job: Job) -> str:
    """Return the id of the capture that a job starts, known before anything is on the disk."""
    return ID_PREFIX + job.id.partition("-")[2]


def _with_live(capture: CaptureDocument, live: LiveCapture | None) -> CaptureDocument:
    if live is None or capture.id != live.id:
        return capture
    progress = None if live.report is None else CaptureProgress.of(live.report)
    return capture.model_copy(
        update={
            "state": live.state,
            "why": live.manual_action,
            "job_id": live.job_id,
            "progress": progress,
            "resumable": False,
        }
    )


def _searched(capture: CaptureDocument) -> str:
    return f"{capture.name} {capture.label} {capture.id} {capture.state}".casefold()
