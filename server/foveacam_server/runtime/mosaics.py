"""Mosaics of captures as jobs beside the rig: made in a process of their own, shown, put into the scene."""

import json
import threading
from dataclasses import asdict

from foveacam_hardware.contract import FoveaError, NotConnected
from foveacam_pipeline.capture.dataset import Dataset
from foveacam_server.capturing.capture_collection import MOSAICS, StoredCapture
from foveacam_server.capturing.mosaic_collection import MosaicCollection, StoredMosaic, recipe_in
from foveacam_server.capturing.mosaic_documents import (
    choices_document,
    made_document,
    mosaic_url,
    viewpoint_of,
)
from foveacam_server.capturing.mosaic_needs import MosaicNeeds, check_room, needs_of
from foveacam_server.capturing.mosaic_process import MosaicSpec
from foveacam_server.errors import problem_of
from foveacam_server.runtime.derived_products import (
    DerivedProduct,
    DerivedProductJobs,
    DerivedProductTools,
    Run,
)
from foveacam_server.runtime.job_table import Job
from foveacam_server.runtime.ports import SceneViewer
from foveacam_server.runtime.store import Document

NOUN = "mosaic"
PROCESS = "foveacam_server.capturing.mosaic_process"


class MosaicService:
    """One door to the mosaics of this data directory."""

    def __init__(self, tools: DerivedProductTools, viewer: SceneViewer | None) -> None:
        """`viewer`: the 3D scene to show them in, if there is one."""
        self.shelf = MosaicCollection(tools.captures.shelf.folder / MOSAICS)
        self._captures, self._viewer = tools.captures, viewer
        self._lock = threading.Lock()
        self._shown: str | None = None
        self._making = DerivedProductJobs(DerivedProduct(noun=NOUN, process=PROCESS, make=self._make), tools)

    def start(self, capture_id: str, wish: MosaicSpec, *, idempotency_key: str | None = None) -> Job:
        """Queue a mosaic, or the rest of one that was begun; refuse at once what cannot be made."""
        return self._making.start(
            capture_id,
            asdict(wish),
            check=lambda kept: check_room(self._needs(kept, wish)),
            idempotency_key=idempotency_key,
        )

    def document(self, capture_id: str) -> Document:
        """Return what there is of a capture's mosaic, and what one would take; raise NotFound."""
        kept, made = self._captures.shelf.get(capture_id), self.shelf.made(capture_id)
        making = self._making.document(capture_id)
        begun = recipe_in(self.shelf.making(capture_id)) is not None
        return {
            "capture_id": capture_id,
            "name": kept.name,
            "state": _state(made, building=making["job_id"] is not None, begun=begun),
            "outdated": made is not None and _outdated(kept.dataset, made),
            **making,
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
        self._captures.shelf.get(capture_id)
        self.check_idle(capture_id, "remove its mosaic")
        self.hide(capture_id)
        self.shelf.remove(capture_id)
        self._making.tell("removed", "a mosaic was removed", capture_id)

    def check_idle(self, capture_id: str, asked: str) -> None:
        """Raise Busy while a mosaic of this capture is being made."""
        self._making.check_idle(capture_id, asked)

    def show(self, capture_id: str) -> None:
        """Put the mosaic's surface into the 3D scene, in the place of another's."""
        kept, made = self._captures.shelf.get(capture_id), self.shelf.require(capture_id)
        content = self.shelf.file(capture_id, "mesh.glb").read_bytes()
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
        self._making.tell("shown", f"the mosaic of capture {kept.name} is in the 3D scene", capture_id)

    def hide(self, capture_id: str) -> None:
        """Take it out of the 3D scene; harmless when it is not there."""
        with self._lock:
            if self._shown != capture_id:
                return
            if self._viewer is not None:
                self._viewer.remove_field()
            self._shown = None
        self._making.tell("hidden", "a mosaic is out of the 3D scene", capture_id)

    def _make(self, kept: StoredCapture, wish: Document, run: Run) -> str:
        run([str(kept.folder), str(self.shelf.prepare(kept.id)), json.dumps(wish)])
        self.hide(kept.id)
        self.shelf.finish(kept.id)
        return mosaic_url(kept.id)

    def _prospect(self, kept: StoredCapture) -> Document:
        """Return what a mosaic of the left eye would take, or why there can be none."""
        try:
            needs = self._needs(kept, MosaicSpec())
            check_room(needs)
        except FoveaError as error:
            return {"needs": None, "refusal": problem_of(error).document()}
        return {"needs": asdict(needs), "refusal": None}

    def _needs(self, kept: StoredCapture, wish: MosaicSpec) -> MosaicNeeds:
        return needs_of(self._making.ended_dataset(kept), wish, self.shelf.folder.parent)


def _state(made: StoredMosaic | None, *, building: bool, begun: bool) -> str:
    if building:
        return "building"
    if made is not None:
        return "complete"
    return "unfinished" if begun else "none"


def _outdated(dataset: Dataset | None, made: StoredMosaic) -> bool:
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
