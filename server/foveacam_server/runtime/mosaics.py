"""Mosaics of captures as jobs beside the rig: made in a process of their own, shown, put into the scene."""

import json
import threading
from dataclasses import asdict, dataclass

from foveacam_hardware.contract import Busy, Clock, FoveaError, NotConnected
from foveacam_pipeline.capture.dataset import Dataset
from foveacam_server.capturing.mosaic_documents import choices_document, made_document, mosaic_url, outlook
from foveacam_server.capturing.mosaic_needs import MosaicNeeds, check_room, needs_of
from foveacam_server.capturing.mosaic_process import MosaicWish
from foveacam_server.capturing.mosaic_shelf import KeptMosaic, MosaicShelf, begun_as
from foveacam_server.capturing.points import readable
from foveacam_server.capturing.shelf import MOSAICS, Kept
from foveacam_server.errors import problem_of
from foveacam_server.runtime.captures import CaptureService
from foveacam_server.runtime.child_process import run_child
from foveacam_server.runtime.events import EventLog
from foveacam_server.runtime.job_table import Job
from foveacam_server.runtime.jobs import JobContext, JobRunner
from foveacam_server.runtime.ports import Viewer
from foveacam_server.runtime.store import Document

KIND = "mosaic"
PROCESS = "foveacam_server.capturing.mosaic_process"


@dataclass(frozen=True, slots=True, kw_only=True)
class MosaicTools:
    """What mosaics work with; without a viewer there is no 3D scene to show them in."""

    captures: CaptureService
    jobs: JobRunner
    events: EventLog
    viewer: Viewer | None
    clock: Clock


class MosaicService:
    """One door to the mosaics of this data directory."""

    def __init__(self, tools: MosaicTools) -> None:
        self.shelf = MosaicShelf(tools.captures.shelf.folder / MOSAICS)
        self._tools = tools
        self._lock = threading.Lock()
        self._live: tuple[str, str] | None = None
        """Id of the capture whose mosaic is being made, and of the job."""
        self._shown: str | None = None
        tools.jobs.handle(KIND, self._work, beside=True)

    def start(self, capture_id: str, wish: MosaicWish, *, idempotency_key: str | None = None) -> Job:
        """Queue a mosaic, or the rest of one that was begun; refuse at once what cannot be made."""
        tools, request = self._tools, {"capture_id": capture_id, **asdict(wish)}
        if tools.jobs.keyed(idempotency_key):
            return tools.jobs.submit(KIND, request, idempotency_key=idempotency_key)
        kept = tools.captures.shelf.get(capture_id)
        check_room(self._needs(kept, wish))
        with self._lock:
            self._check_free()
            job = tools.jobs.submit(KIND, request, idempotency_key=idempotency_key)
            self._live = capture_id, job.id
        self._tell("mosaic.begun", f"a mosaic of capture {kept.name} was asked for", capture_id)
        return job

    def document(self, capture_id: str) -> Document:
        """Return what there is of a capture's mosaic, and what one would take; raise NotFound."""
        kept, made = self._tools.captures.shelf.get(capture_id), self.shelf.made(capture_id)
        job = self._job_of(capture_id)
        begun = begun_as(self.shelf.making(capture_id)) is not None
        return {
            "capture_id": capture_id,
            "name": kept.name,
            "state": _state(made, building=job is not None, begun=begun),
            "outdated": made is not None and _outdated(kept.dataset, made),
            "job_id": None if job is None else job.id,
            "progress": None if job is None else job.document()["progress"],
            **self._prospect(kept),
            **choices_document(kept.dataset),
            "in_scene": self._shown == capture_id,
            "made": None if made is None else made_document(capture_id, made, kept.dataset),
            "url": mosaic_url(capture_id),
        }

    def at_url(self, url: str) -> Document:
        """Return the document that a job's result URL names."""
        return self.document(url.split("/")[-2])

    def remove(self, capture_id: str) -> None:
        """Remove a capture's mosaic, half made ones too; refused while one is being made."""
        self._tools.captures.shelf.get(capture_id)
        self.check_idle(capture_id, "remove its mosaic")
        self.hide(capture_id)
        self.shelf.remove(capture_id)
        self._tell("mosaic.removed", "a mosaic was removed", capture_id)

    def check_idle(self, capture_id: str, asked: str) -> None:
        """Raise Busy while a mosaic of this capture is being made."""
        if self._job_of(capture_id) is not None:
            raise Busy(
                f"asked to {asked}: the mosaic of capture {capture_id} is being made; wait for it, or cancel "
                "its job",
                asked=asked,
                found="its mosaic is being made",
                remedy="wait for it, or cancel its job",
            )

    def show(self, capture_id: str) -> None:
        """Put the mosaic's surface into the 3D scene, in the place of another's."""
        kept, made = self._tools.captures.shelf.get(capture_id), self.shelf.require(capture_id)
        content = self.shelf.file(capture_id, "mesh.glb").read_bytes()
        if self._tools.viewer is None:
            raise NotConnected(
                "there is no 3D scene: it is switched off, or could not be started; open mesh.glb elsewhere",
                asked="show a mosaic in 3D",
                found="there is no 3D scene",
                remedy="download mesh.glb and open it elsewhere",
            )
        with self._lock:
            stand, middle = outlook(made)
            self._tools.viewer.show_field(content, from_rig_m=stand, to_rig_m=middle)
            self._shown = capture_id
        self._tell("mosaic.shown", f"the mosaic of capture {kept.name} is in the 3D scene", capture_id)

    def hide(self, capture_id: str) -> None:
        """Take it out of the 3D scene; harmless when it is not there."""
        with self._lock:
            if self._shown != capture_id:
                return
            if self._tools.viewer is not None:
                self._tools.viewer.remove_field()
            self._shown = None
        self._tell("mosaic.hidden", "a mosaic is out of the 3D scene", capture_id)

    def _work(self, context: JobContext) -> str:
        request = dict(context.job.request)
        capture_id = str(request.pop("capture_id"))
        wish, kept = MosaicWish(**request), self._tools.captures.shelf.get(capture_id)
        began_ns = self._tools.clock.now_ns()

        def told(step: Document) -> None:
            spent_s = (self._tools.clock.now_ns() - began_ns) / 1e9
            left_s = spent_s * (1.0 / step["share"] - 1.0) if step["share"] else None
            context.progress(step["done"], total=step["total"], note=step["note"], left_s=left_s)

        try:
            folder = self.shelf.prepare(capture_id)
            arguments = [str(kept.folder), str(folder), json.dumps(asdict(wish))]
            run_child(PROCESS, arguments, told=told, cancelled=context.cancelled)
            self.hide(capture_id)
            self.shelf.finish(capture_id)
        finally:
            with self._lock:
                self._live = None
            self._tell("mosaic.ended", f"the mosaic of capture {kept.name} ended", capture_id)
        return mosaic_url(capture_id)

    def _prospect(self, kept: Kept) -> Document:
        """Return what a mosaic of the left eye would take, or why there can be none."""
        try:
            needs = self._needs(kept, MosaicWish())
            check_room(needs)
        except FoveaError as error:
            return {"needs": None, "refusal": problem_of(error).document()}
        return {"needs": asdict(needs), "refusal": None}

    def _needs(self, kept: Kept, wish: MosaicWish) -> MosaicNeeds:
        dataset = readable(kept)
        if self._tools.captures.document(kept.id)["job_id"] is not None:
            raise Busy(
                f"capture {kept.name} is still running; its mosaic can be made when it has ended",
                asked=f"the mosaic of {kept.name}",
                found="it is still running",
                remedy="wait for its end",
            )
        return needs_of(dataset, wish, self.shelf.folder.parent)

    def _check_free(self) -> None:
        live = self._live
        if live is not None and not self._tools.jobs.get(live[1]).state.ended:
            raise Busy(
                f"the mosaic of capture {live[0]} is being made; wait for it, or cancel its job",
                found=f"the mosaic of capture {live[0]} is being made",
                remedy="wait for it, or cancel its job",
            )

    def _job_of(self, capture_id: str) -> Job | None:
        live = self._live
        if live is None or live[0] != capture_id:
            return None
        job = self._tools.jobs.get(live[1])
        return None if job.state.ended else job

    def _tell(self, kind: str, message: str, capture_id: str) -> None:
        self._tools.events.emit(kind, message, data={"capture_id": capture_id})


def _state(made: KeptMosaic | None, *, building: bool, begun: bool) -> str:
    if building:
        return "building"
    if made is not None:
        return "complete"
    return "unfinished" if begun else "none"


def _outdated(dataset: Dataset | None, made: KeptMosaic) -> bool:
    """Tell whether the capture has grown since: a dataset's points are never changed, only added."""
    if dataset is None:
        return False
    settings = made.document["recipe"]["settings"]
    points = [point for point in dataset if point.place.scan == settings["scan"]]
    usable = [
        point
        for point in points
        if point.pose.volts is not None
        and any(
            frame.role.value == settings["eye"] and frame.bracket == settings["bracket"]
            for frame in point.frames
        )
    ]
    return len(usable) != int(made.document["figures"]["views"])
