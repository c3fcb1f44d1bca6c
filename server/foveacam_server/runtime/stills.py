"""Stills as jobs: taken where the mirrors stand, held on the disk, kept or discarded."""

import shutil
import threading
from pathlib import Path

from foveacam_hardware.contract import Frame, Role
from foveacam_pipeline.capture.dataset import ImageCodec, change_labels
from foveacam_pipeline.capture.still import (
    StillKeep,
    StillLabels,
    StillPlan,
    check_still_room,
    still_bytes,
    take_still,
    write_still,
)
from foveacam_server.capturing.rig_facts import rig_facts
from foveacam_server.capturing.still_collection import URL, StillCollection, StillState, StoredStill
from foveacam_server.capturing.still_documents import still_document
from foveacam_server.runtime import refusals
from foveacam_server.runtime.captures import CaptureTools
from foveacam_server.runtime.hardware_commands import answer_of
from foveacam_server.runtime.job_table import Job
from foveacam_server.runtime.jobs import JobContext
from foveacam_server.runtime.rig_access import StillRigAccess, check_may_expose
from foveacam_server.runtime.store import Document

KIND = "still"
ID_PREFIX = "still-"


class StillJobWatcher:
    """Implements the pipeline's `StillWatcher` for one job: progress, and frames as views."""

    def __init__(self, context: JobContext, tools: CaptureTools) -> None:
        self._context, self._tools = context, tools

    def progress(self, done: int, *, total: int, note: str) -> None:
        """Tell how many frames came."""
        self._context.progress(done, total=total, note=note)

    def cancelled(self) -> bool:
        """Tell whether the job shall end."""
        return self._context.cancelled()

    def show_frames(self, frames: tuple[Frame, ...]) -> None:
        """Show what was just taken in the live views."""
        gaze = self._tools.hardware.pose
        for frame in frames:
            meta = self._tools.overlay(gaze) if frame.role is Role.WIDE else None
            self._tools.sink.publish_frame(frame, meta=meta)


class StillService:
    """One door to the stills of this data directory."""

    def __init__(self, folder: Path, tools: CaptureTools) -> None:
        self.shelf = StillCollection(folder)
        self._tools = tools
        self._lock = threading.Lock()
        tools.jobs.handle(KIND, self._work)

    def start(self, request: Document, *, idempotency_key: str | None = None) -> Job:
        """Queue a still; refuse at once what could not be done now."""
        jobs, hardware = self._tools.jobs, self._tools.hardware
        if jobs.keyed(idempotency_key):
            return jobs.submit(KIND, request, idempotency_key=idempotency_key)
        with self._lock:
            plan = plan_of(request)
            if hardware.busy_with is not None:
                raise refusals.in_use("take a still", hardware.busy_with)
            self.shelf.new_folder(request["name"], waits=not request["save"])
            if plan.foveae:
                check_may_expose(hardware)
            self._check_room(plan)
            return jobs.submit(KIND, request, idempotency_key=idempotency_key)

    def every(self, *, text: str = "", state: StillState = StillState.KEPT) -> list[Document]:
        """Return the stills of one state whose name, label or id holds every word of `text`."""
        words = text.casefold().split()
        found = [still_document(still) for still in self.shelf.every(state)]
        return [document for document in found if all(word in _searched(document) for word in words)]

    def document(self, still_id: str) -> Document:
        """Return one still, held or kept, or raise NotFound."""
        return still_document(self.shelf.get(still_id))

    def at_url(self, url: str) -> Document:
        """Return the still that a job's result URL names."""
        return self.document(url.rsplit("/", 1)[1])

    def keep(self, still_id: str, *, name: str | None, label: str | None) -> Document:
        """Keep a still that is held; what is given of name and label is changed."""
        found = self.shelf.get(still_id)
        if label is not None and found.state is StillState.HELD:
            change_labels(found.stored.folder, label=label)
        found = self.shelf.keep(still_id, name=name)
        self._tell("still.kept", f"still {found.stored.name} is kept", found)
        return still_document(found)

    def describe(self, still_id: str, *, label: str | None, licence: str | None) -> Document:
        """Change label or licence."""
        change_labels(self.shelf.get(still_id).stored.folder, label=label, licence=licence)
        found = self.shelf.get(still_id)
        self._tell("still.updated", f"still {found.stored.name} was described anew", found)
        return still_document(found)

    def remove(self, still_id: str) -> None:
        """Move a still to the trash, whether it is held or kept."""
        kept = self.shelf.remove(still_id)
        found = StoredStill(stored=kept, state=StillState.REMOVED)
        self._tell("still.removed", f"still {kept.name} is in the trash", found)

    def restore(self, still_id: str) -> Document:
        """Take a still out of the trash; it is kept then."""
        found = self.shelf.restore(still_id)
        self._tell("still.updated", f"still {found.stored.name} is out of the trash", found)
        return still_document(found)

    def _work(self, context: JobContext) -> str:
        tools, request = self._tools, context.job.request
        still_id = ID_PREFIX + context.job.id.partition("-")[2]
        folder, plan = self.shelf.new_folder(request["name"], waits=not request["save"]), plan_of(request)
        with tools.hardware.session("a still", cancelled=context.cancelled) as head:
            access = StillRigAccess(tools.hardware, head, clock=tools.clock)
            still = take_still(access, plan, watch=StillJobWatcher(context, tools))
        labels = StillLabels(
            label=request["label"],
            licence=request["licence"],
            codec=ImageCodec(request["codec"]),
            id=still_id,
        )
        write_still(folder, still, tools.calibration.current, labels)
        context.job.result_url = url = f"{URL}/{still_id}"
        trouble = still.missing_error(kept=f"what came is held, keep or discard it: {url}")
        if trouble is None and request["save"]:
            self.shelf.keep(still_id)
        self._tell("still.taken", f"still {folder.name} was taken", self.shelf.get(still_id))
        if trouble is not None:
            raise trouble
        return url

    def _check_room(self, plan: StillPlan) -> None:
        facts = answer_of(self._tools.hardware.submit(rig_facts), asked="the rig's settings")
        calibration = self._tools.calibration.current
        if calibration is None:  # nobody knows how large the pictures are; the writer tells of a full disk
            return
        fovea, wide = facts.sizes(calibration)
        free_bytes = shutil.disk_usage(self.shelf.folder).free
        check_still_room(still_bytes(plan, fovea=fovea, wide=wide), free_bytes=free_bytes)

    def _tell(self, kind: str, message: str, found: StoredStill) -> None:
        data = {"still_id": found.stored.id, "name": found.stored.name, "state": found.state.value}
        self._tools.events.emit(kind, message, data=data)


def plan_of(request: Document) -> StillPlan:
    """Return the plan of a request."""
    return StillPlan(
        frames=request["stack_frames"],
        keep=StillKeep(request["stack_keep"]),
        roles=tuple(Role(name) for name in request["cameras"]),
    )


def _searched(document: Document) -> str:
    return f"{document['name']} {document['label']} {document['id']}".casefold()
