"""Takes stills as jobs at the mirrors' present pose; holds them on the disk until kept or discarded."""

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
from foveacam_server.datasets.capture_tools import CaptureTools, rig_facts
from foveacam_server.foundation.job_table import Job
from foveacam_server.foundation.jobs import JobContext
from foveacam_server.resources.capturing.stills.collection import (
    URL,
    StillCollection,
    StillState,
    StoredStill,
)
from foveacam_server.resources.capturing.stills.schema import (
    StillDocument,
    StillEvent,
    StillKeepRequest,
    StillPatch,
    StillRequest,
)
from foveacam_server.rig.access import StillRigAccess, check_may_expose
from foveacam_server.rig.hardware_commands import answer_of

KIND = "still"
ID_PREFIX = "still-"


class StillJobWatcher:
    """Implements the pipeline's `StillWatcher` for one job: reports progress, shows frames in the views."""

    def __init__(self, context: JobContext, tools: CaptureTools) -> None:
        self._context, self._tools = context, tools

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        """Report the number of frames taken."""
        self._context.progress(done, total=total, note=note)

    def cancelled(self) -> bool:
        """Return whether the job was cancelled."""
        return self._context.cancelled()

    def show_frames(self, frames: tuple[Frame, ...]) -> None:
        """Show frames that were taken in the live views."""
        gaze = self._tools.hardware.pose
        for frame in frames:
            meta = self._tools.overlay(gaze) if frame.role is Role.WIDE else None
            self._tools.sink.publish_frame(frame, meta=meta)


class StillService:
    """The stills of this data directory: take, list, keep, change, remove."""

    def __init__(self, folder: Path, tools: CaptureTools) -> None:
        self.collection = StillCollection(folder)
        self._tools = tools
        self._lock = threading.Lock()
        tools.jobs.handle(KIND, self._work)

    def start(self, request: StillRequest, *, idempotency_key: str | None = None) -> Job:
        """Queue a still; raise at once where it cannot be taken now."""
        jobs, hardware = self._tools.jobs, self._tools.hardware
        if jobs.has_key(idempotency_key):
            return jobs.submit(KIND, request, idempotency_key=idempotency_key)
        with self._lock:
            plan = _plan_of(request)
            hardware.use.check_free("take a still")
            self.collection.new_folder(request.name, waits=not request.save)
            if plan.foveae:
                check_may_expose(hardware)
            self._check_room(plan)
            return jobs.submit(KIND, request, idempotency_key=idempotency_key)

    def search(self, *, text: str = "", state: StillState = StillState.KEPT) -> list[StillDocument]:
        """Return the stills of one state whose name, label or id contains every word of `text`."""
        words = text.casefold().split()
        found = [StillDocument.of(still) for still in self.collection.every(state)]
        return [still for still in found if all(word in _searched(still) for word in words)]

    def get(self, still_id: str) -> StillDocument:
        """Return a still, held or kept, or raise NotFound."""
        return StillDocument.of(self.collection.get(still_id))

    def keep(self, still_id: str, request: StillKeepRequest) -> StillDocument:
        """Keep a held still, under another name or label if given."""
        found = self.collection.get(still_id)
        if request.label is not None and found.state is StillState.HELD:
            change_labels(found.stored.folder, label=request.label)
        found = self.collection.keep(still_id, name=request.name)
        self._emit("still.kept", f"still {found.stored.name} is kept", found)
        return StillDocument.of(found)

    def edit(self, still_id: str, change: StillPatch) -> StillDocument:
        """Change label or licence."""
        folder = self.collection.get(still_id).stored.folder
        change_labels(folder, label=change.label, licence=change.licence)
        found = self.collection.get(still_id)
        self._emit("still.updated", f"still {found.stored.name} has another label or licence", found)
        return StillDocument.of(found)

    def remove(self, still_id: str) -> None:
        """Move a held or kept still to the trash."""
        kept = self.collection.remove(still_id)
        found = StoredStill(stored=kept, state=StillState.REMOVED)
        self._emit("still.removed", f"still {kept.name} is in the trash", found)

    def restore(self, still_id: str) -> StillDocument:
        """Restore a still from the trash; it is kept afterwards."""
        found = self.collection.restore(still_id)
        self._emit("still.updated", f"still {found.stored.name} is out of the trash", found)
        return StillDocument.of(found)

    def report_update(self, still_id: str, message: str) -> None:
        """Emit `still.updated` for a still that another service has changed."""
        self._emit("still.updated", message, self.collection.get(still_id))

    def _work(self, context: JobContext) -> str:
        tools = self._tools
        request = context.job.parse_request(StillRequest)
        still_id = ID_PREFIX + context.job.id.partition("-")[2]
        folder, plan = self.collection.new_folder(request.name, waits=not request.save), _plan_of(request)
        with tools.hardware.session("a still", cancelled=context.cancelled, binning=1) as head:
            access = StillRigAccess(tools.hardware, head, clock=tools.clock)
            still = take_still(access, plan, watch=StillJobWatcher(context, tools))
        labels = StillLabels(
            label=request.label,
            licence=request.licence,
            codec=ImageCodec(request.codec),
            id=still_id,
        )
        write_still(folder, still, tools.calibration.current, labels)
        context.job.result_url = url = f"{URL}/{still_id}"
        trouble = still.missing_error(kept=f"the frames so far are held, keep or discard them: {url}")
        if trouble is None and request.save:
            self.collection.keep(still_id)
        self._emit("still.taken", f"still {folder.name} was taken", self.collection.get(still_id))
        if trouble is not None:
            raise trouble
        return url

    def _check_room(self, plan: StillPlan) -> None:
        facts = answer_of(self._tools.hardware.submit(rig_facts), asked="the rig's settings")
        calibration = self._tools.calibration.current
        if calibration is None:  # sizes of the pictures are unknown; the writer raises for a full disk
            return
        fovea, wide = facts.sizes(calibration)
        free_bytes = shutil.disk_usage(self.collection.folder).free
        check_still_room(still_bytes(plan, fovea=fovea, wide=wide), free_bytes=free_bytes)

    def _emit(self, kind: str, message: str, found: StoredStill) -> None:
        event = StillEvent(still_id=found.stored.id, name=found.stored.name, state=found.state.value)
        self._tools.events.emit(kind, message, data=event)


def _plan_of(request: StillRequest) -> StillPlan:
    return StillPlan(
        frames=request.stack_frames,
        keep=StillKeep(request.stack_keep),
        roles=tuple(Role(name) for name in request.cameras),
    )


def _searched(still: StillDocument) -> str:
    return f"{still.name} {still.label} {still.id}".casefold()
