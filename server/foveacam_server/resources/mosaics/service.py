"""Computes mosaics of captures as jobs in child processes; serves them and shows them in the 3D scene."""

import json
import threading
from dataclasses import asdict

from foveacam_hardware.contract import FoveaError, NotConnected
from foveacam_pipeline.capture.dataset import Dataset
from foveacam_server.datasets.collection import StoredCapture
from foveacam_server.datasets.derived_products import (
    DerivedProduct,
    DerivedProductJobs,
    DerivedProductTools,
    Run,
)
from foveacam_server.foundation.errors import problem_of
from foveacam_server.foundation.job_table import Job
from foveacam_server.foundation.schema import Problem
from foveacam_server.foundation.store import Document
from foveacam_server.resources.mosaics.collection import MOSAICS, MosaicCollection, StoredMosaic, recipe_in
from foveacam_server.resources.mosaics.documents import (
    choices_document,
    made_document,
    mosaic_url,
    viewpoint_of,
)
from foveacam_server.resources.mosaics.needs import MosaicNeeds, check_room, needs_of
from foveacam_server.resources.mosaics.process import MosaicSpec
from foveacam_server.resources.mosaics.schema import MadeMosaic, MosaicDocument, MosaicNeedsDocument, State
from foveacam_server.rig.ports import SceneViewer

NOUN = "mosaic"
PROCESS = "foveacam_server.resources.mosaics.process"


class MosaicService:
    """All that REST offers of the mosaics of this data directory."""

    def __init__(self, tools: DerivedProductTools, viewer: SceneViewer | None) -> None:
        """Open the collection; `viewer`: the 3D scene, if there is one."""
        self.collection = MosaicCollection(tools.captures.collection.folder / MOSAICS)
        tools.captures.collection.on_delete(self.collection.remove)
        self._captures, self._viewer = tools.captures, viewer
        self._lock = threading.Lock()
        self._shown: str | None = None
        self._making = DerivedProductJobs(DerivedProduct(noun=NOUN, process=PROCESS, make=self._make), tools)

    def start(self, capture_id: str, spec: MosaicSpec, *, idempotency_key: str | None = None) -> Job:
        """Queue a mosaic, or the rest of an unfinished one; raise at once when it cannot be computed."""
        return self._making.start(
            capture_id,
            asdict(spec),
            check=lambda kept: check_room(self._needs(kept, spec)),
            idempotency_key=idempotency_key,
        )

    def get(self, capture_id: str) -> MosaicDocument:
        """Return the state of a capture's mosaic and what computing one would take; raise NotFound."""
        kept, made = self._captures.collection.get(capture_id), self.collection.made(capture_id)
        job = self._making.running_job(capture_id)
        begun = recipe_in(self.collection.making(capture_id)) is not None
        needs, refusal = self._outlook(kept)
        return MosaicDocument(
            capture_id=capture_id,
            name=kept.name,
            state=_state(made, building=job is not None, begun=begun),
            outdated=made is not None and _outdated(kept.dataset, made),
            job_id=None if job is None else job.id,
            progress=None if job is None else job.progress,
            needs=needs,
            refusal=refusal,
            **choices_document(kept.dataset),
            in_scene=self._shown == capture_id,
            made=None
            if made is None
            else MadeMosaic.model_validate(made_document(capture_id, made, kept.dataset)),
            url=mosaic_url(capture_id),
        )

    def get_by_url(self, url: str) -> MosaicDocument:
        """Return the mosaic that a job's result URL names."""
        return self.get(url.split("/")[-2])

    def remove(self, capture_id: str) -> None:
        """Remove a capture's mosaic and an unfinished one; raise `Busy` while one is being computed."""
        self._captures.collection.get(capture_id)
        self.check_idle(capture_id, "remove its mosaic")
        self.hide(capture_id)
        self.collection.remove(capture_id)
        self._making.emit("removed", "a mosaic was removed", capture_id)

    def check_idle(self, capture_id: str, asked: str) -> None:
        """Raise Busy while a mosaic of this capture is being computed."""
        self._making.check_idle(capture_id, asked)

    def show(self, capture_id: str) -> None:
        """Show the mosaic's surface in the 3D scene instead of another's."""
        kept, made = self._captures.collection.get(capture_id), self.collection.require(capture_id)
        content = self.collection.file(capture_id, "mesh.glb").read_bytes()
        if self._viewer is None:
            raise NotConnected(
                "there is no 3D scene: it is switched off, or could not be started; open mesh.glb elsewhere",
                asked="show a mosaic in 3D",
                found="there is no 3D scene",
                remedy="download mesh.glb and open it elsewhere",
            )
        with self._lock:
            stand, middle = viewpoint_of(made)
            self._viewer.show_field(content, from_rig_m=stand, to_rig_m=middle)
            self._shown = capture_id
        self._making.emit("shown", f"the mosaic of capture {kept.name} is in the 3D scene", capture_id)

    def hide(self, capture_id: str) -> None:
        """Remove the surface from the 3D scene, if it is there."""
        with self._lock:
            if self._shown != capture_id:
                return
            if self._viewer is not None:
                self._viewer.remove_field()
            self._shown = None
        self._making.emit("hidden", "a mosaic is out of the 3D scene", capture_id)

    def _make(self, kept: StoredCapture, spec: Document, run: Run) -> str:
        run([str(kept.folder), str(self.collection.prepare(kept.id)), json.dumps(spec)])
        self.hide(kept.id)
        self.collection.finish(kept.id)
        return mosaic_url(kept.id)

    def _outlook(self, kept: StoredCapture) -> tuple[MosaicNeedsDocument | None, Problem | None]:
        """Return what a mosaic of the left eye would take, or why there can be none."""
        try:
            needs = self._needs(kept, MosaicSpec())
            check_room(needs)
        except FoveaError as error:
            return None, Problem.model_validate(problem_of(error).document())
        return MosaicNeedsDocument.model_validate(asdict(needs)), None

    def _needs(self, kept: StoredCapture, spec: MosaicSpec) -> MosaicNeeds:
        return needs_of(self._making.ended_dataset(kept), spec, self.collection.folder.parent)


def _state(made: StoredMosaic | None, *, building: bool, begun: bool) -> State:
    if building:
        return "building"
    if made is not None:
        return "complete"
    return "unfinished" if begun else "none"


def _outdated(dataset: Dataset | None, made: StoredMosaic) -> bool:
    """Return whether points were added to the capture since; points never change."""
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
