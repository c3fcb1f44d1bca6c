"""Captures as jobs: begun, paused, gone on with; one at a time, as each has the rig to itself."""

import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from foveacam_hardware.contract import Busy, Clock
from foveacam_pipeline.capture.dataset import ImageCodec
from foveacam_pipeline.capture.dataset.labels import change_labels
from foveacam_pipeline.capture.plan import RasterPlan, plan_from
from foveacam_pipeline.capture.run import run_capture
from foveacam_server.capturing.begin import (
    CaptureSpec,
    begin_dataset,
    check_remaining_room,
    check_resumable,
    check_room,
    resume_dataset,
)
from foveacam_server.capturing.capture_collection import CaptureCollection, StoredCapture
from foveacam_server.capturing.documents import URL, capture_document, report_document
from foveacam_server.capturing.rig_facts import RigFacts, check_possible, estimate_plan, rig_facts
from foveacam_server.runtime import refusals
from foveacam_server.runtime.calibrations import CalibrationService
from foveacam_server.runtime.capture_job_watcher import CaptureJobWatcher, LiveCapture
from foveacam_server.runtime.events import EventLog
from foveacam_server.runtime.hardware import HardwareThread
from foveacam_server.runtime.hardware_commands import answer_of
from foveacam_server.runtime.job_table import Job
from foveacam_server.runtime.jobs import JobContext, JobRunner
from foveacam_server.runtime.live_views import OverlayOf
from foveacam_server.runtime.ports import PictureSink
from foveacam_server.runtime.rig_access import ThreadAccess
from foveacam_server.runtime.store import Document

KIND = "capture"
ID_PREFIX = "cap-"


@dataclass(frozen=True, slots=True, kw_only=True)
class CaptureTools:
    """What captures work with. `distance_m`: of what was verged on last, infinite while nothing was."""

    hardware: HardwareThread
    calibration: CalibrationService
    jobs: JobRunner
    sink: PictureSink
    overlay: OverlayOf
    distance_m: Callable[[], float]
    events: EventLog
    clock: Clock


class CaptureService:
    """One door to the captures of this data directory."""

    def __init__(self, folder: Path, tools: CaptureTools) -> None:
        self.shelf = CaptureCollection(folder)
        self._tools = tools
        self._lock = threading.Lock()
        self._live: LiveCapture | None = None
        tools.jobs.handle(KIND, self._work)

    # What the rig does ------------------------------------------------------------------------------------

    def start(self, request: Document, *, idempotency_key: str | None = None) -> Job:
        """Queue a capture; refuse at once what could not be done now."""
        if self._tools.jobs.keyed(idempotency_key):
            return self._tools.jobs.submit(KIND, request, idempotency_key=idempotency_key)
        with self._lock:
            self._check_free("begin a capture")
            folder = self.shelf.new_folder(request["name"])
            plan, calibration = plan_from(request["plan"]), self._tools.calibration.require()
            facts = self._facts()
            self._tools.hardware.check_may_move()
            check_possible(plan, calibration, facts)
            check_room(plan, facts, calibration, codec=ImageCodec(request["codec"]), folder=folder.parent)
            job = self._tools.jobs.submit(KIND, request, idempotency_key=idempotency_key)
            self._live = LiveCapture(id=_capture_id(job), name=folder.name, job_id=job.id)
        self._tell("capture.created", f"capture {folder.name} was asked for", self._live.id)
        return job

    def resume(self, capture_id: str, *, idempotency_key: str | None = None) -> Job:
        """Queue the rest of a capture that was interrupted or cancelled."""
        request = {"capture_id": capture_id}
        if self._tools.jobs.keyed(idempotency_key):
            return self._tools.jobs.submit(KIND, request, idempotency_key=idempotency_key)
        with self._lock:
            self._check_free("resume a capture")
            kept = self.shelf.get(capture_id)
            check_resumable(kept)
            self._tools.hardware.check_may_move()
            check_remaining_room(kept.folder, self._facts())
            job = self._tools.jobs.submit(KIND, request, idempotency_key=idempotency_key)
            self._live = LiveCapture(id=capture_id, name=kept.name, job_id=job.id)
        return job

    def pause(self, capture_id: str) -> Document:
        """Let a running capture wait after its next point; harmless when it waits."""
        live = self._running(capture_id, "pause")
        live.pausing.set()
        return self.document(capture_id)

    def go_on(self, capture_id: str) -> Document:
        """Let a paused capture go on; harmless when it runs."""
        live = self._running(capture_id, "let go on")
        live.pausing.clear()
        return self.document(capture_id)

    def estimate(self, plan: RasterPlan, *, codec: ImageCodec, distance_m: float | None) -> Document:
        """Return time, size, warnings and footprints of a plan, at a distance where it leaves that open."""
        return estimate_plan(
            plan,
            self._tools.calibration.require(),
            self._facts(),
            codec=codec,
            assumed_m=distance_m or self._tools.distance_m(),
            folder=self.shelf.folder,
        )

    # What lies on the disk --------------------------------------------------------------------------------

    def every(self, *, text: str = "", removed: bool = False) -> list[Document]:
        """Return captures whose name, label or id holds `text`, newest first; or what is in the trash."""
        if removed:
            found = [capture_document(kept) for kept in self.shelf.trash()]
        else:
            found = [self._shown(kept) for kept in self.shelf.every()]
            live = self._current()
            if live is not None and all(document["id"] != live.id for document in found):
                found.insert(0, self._not_begun(live))
        words = text.casefold().split()
        return [document for document in found if all(word in _searched(document) for word in words)]

    def document(self, capture_id: str) -> Document:
        """Return one capture or raise NotFound."""
        live = self._current()
        begun = any(kept.id == capture_id for kept in self.shelf.every())
        if live is not None and live.id == capture_id and not begun:
            return self._not_begun(live)
        return self._shown(self.shelf.get(capture_id))

    def at_url(self, url: str) -> Document:
        """Return the capture that a job's result URL names."""
        return self.document(url.rsplit("/", 1)[1])

    def describe(self, capture_id: str, *, label: str | None, licence: str | None) -> Document:
        """Change label or licence; refused while it is being written."""
        change_labels(self.shelf.get(capture_id).folder, label=label, licence=licence)
        self._tell("capture.updated", "a capture was described anew", capture_id)
        return self.document(capture_id)

    def remove(self, capture_id: str) -> Document:
        """Move a capture to the trash; refused while it runs."""
        live = self._current()
        if live is not None and live.id == capture_id:
            raise refusals.in_use(f"remove capture {live.name}", f"capture {live.name}")
        kept = self.shelf.remove(capture_id)
        data = {"capture_id": capture_id, "name": kept.name}
        self._tools.events.emit("capture.removed", f"capture {kept.name} is in the trash", data=data)
        return data

    def restore(self, capture_id: str) -> Document:
        """Take a capture out of the trash."""
        kept = self.shelf.restore(capture_id)
        self._tell("capture.updated", f"capture {kept.name} is out of the trash", kept.id)
        return self.document(kept.id)

    # The job ----------------------------------------------------------------------------------------------

    def _work(self, context: JobContext) -> str:
        tools, request, live = self._tools, context.job.request, self._live_of(context.job)
        watch = CaptureJobWatcher(
            context, live, sink=tools.sink, overlay=tools.overlay, events=tools.events, clock=tools.clock
        )
        try:
            with tools.hardware.session(f"capture {live.name}", cancelled=context.cancelled) as head:
                access = ThreadAccess(tools.hardware, head, clock=tools.clock)
                if "capture_id" in request:
                    writer = resume_dataset(access, self.shelf.get(live.id).folder)
                else:
                    wish = _wish(request, live.id)
                    folder = self.shelf.new_folder(request["name"])
                    writer = begin_dataset(access, folder, wish, tools.calibration.require(), watch=watch)
                with writer:
                    run_capture(access, writer, watch=watch)
        finally:
            with self._lock:
                self._live = None
            self._tell_end(live)
        return f"{URL}/{live.id}"

    def _facts(self) -> RigFacts:
        return answer_of(self._tools.hardware.submit(rig_facts), asked="the rig's settings")

    def _check_free(self, asked: str) -> None:
        live = self._current()
        holder = f"capture {live.name}" if live is not None else self._tools.hardware.busy_with
        if holder is not None:
            raise refusals.in_use(asked, holder)

    def _current(self) -> LiveCapture | None:
        """Return the capture that waits or runs; a job that ended before it began leaves none."""
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
            kept = self.shelf.get(capture_id)
            raise Busy(
                f"asked to {asked} capture {kept.name}: it does not run; resume it, if it is partial",
                asked=f"{asked} capture {kept.name}",
                found="it does not run",
                remedy="resume it, if it is partial",
            )
        return live

    def _shown(self, kept: StoredCapture) -> Document:
        return _with_live(capture_document(kept), self._current())

    def _not_begun(self, live: LiveCapture) -> Document:
        empty = StoredCapture(id=live.id, folder=self.shelf.folder / live.name, dataset=None)
        return _with_live(capture_document(empty), live)

    def _tell(self, kind: str, message: str, capture_id: str) -> None:
        self._tools.events.emit(kind, message, data={"capture_id": capture_id})

    def _tell_end(self, live: LiveCapture) -> None:
        found = next((kept for kept in self.shelf.every() if kept.id == live.id), None)
        if found is None:
            self._tell("capture.ended", f"capture {live.name} ended before its first point", live.id)
            return
        document = capture_document(found)
        told = f"capture {live.name} is {document['state']}" + (
            f": {document['why']}" if document["why"] else ""
        )
        data = {"capture_id": live.id, "state": document["state"], "why": document["why"]}
        self._tools.events.emit("capture.ended", told, data=data)


def _wish(request: Document, capture_id: str) -> CaptureSpec:
    return CaptureSpec(
        plan=plan_from(request["plan"]),
        label=request["label"],
        licence=request["licence"],
        codec=ImageCodec(request["codec"]),
        capture_id=capture_id,
    )


def _capture_id(job: Job) -> str:
    """Return the id of the capture that a job begins: known before anything lies on the disk."""
    return ID_PREFIX + job.id.partition("-")[2]


def _with_live(document: Document, live: LiveCapture | None) -> Document:
    if live is None or document["id"] != live.id:
        return document
    progress = None if live.report is None else report_document(live.report)
    return document | {
        "state": live.state,
        "why": live.wish,
        "job_id": live.job_id,
        "progress": progress,
        "resumable": False,
    }


def _searched(document: Document) -> str:
    return f"{document['name']} {document['label']} {document['id']} {document['state']}".casefold()
