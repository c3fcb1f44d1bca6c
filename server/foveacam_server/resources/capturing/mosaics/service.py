"""Computes mosaics of captures as jobs in child processes; serves them and shows them in the 3D scene."""

import threading
from collections.abc import Callable
from typing import TypeAlias

from foveacam_hardware.contract import FoveaError, NotConnected
from foveacam_pipeline.capture.dataset import Dataset
from foveacam_pipeline.capture.mosaic.chart import Chart
from foveacam_pipeline.networks.card import StereoNetwork
from foveacam_server.datasets.collection import StoredCapture, brackets_of
from foveacam_server.datasets.derived_products import (
    DerivedProduct,
    DerivedProductJobs,
    DerivedProductTools,
    Run,
)
from foveacam_server.foundation.errors import problem_of
from foveacam_server.foundation.job_table import Job
from foveacam_server.foundation.schema import Problem
from foveacam_server.resources.capturing.mosaics.collection import (
    MOSAICS,
    DepthTilesFile,
    MosaicCollection,
    StoredMosaic,
    mosaic_url,
    recipe_in,
)
from foveacam_server.resources.capturing.mosaics.needs import check_room, needs_of
from foveacam_server.resources.capturing.mosaics.schema import (
    MosaicDocument,
    MosaicNeedsDocument,
    MosaicRequest,
    State,
)
from foveacam_server.rig.ports import SceneViewer

NOUN = "mosaic"
PROCESS = "foveacam_server.resources.capturing.mosaics.process"
NEAREST_SHARE = 0.8
"""Distance of the viewpoint, as a share of the nearest depth."""
FIT_WIDTHS = 1.5
"""Distance of the viewpoint, in field widths, from which the whole field is visible."""
LIFT = 0.06
"""Offset of the viewpoint aside and above, per metre of distance: seen head-on, a surface looks flat."""
Point: TypeAlias = tuple[float, float, float]


class MosaicService:
    """The mosaics of this data directory: compute, serve, show in the 3D scene."""

    def __init__(
        self,
        tools: DerivedProductTools,
        viewer: SceneViewer | None,
        *,
        network_in_use: Callable[[], StereoNetwork | None],
    ) -> None:
        """Open the collection; `viewer`: the 3D scene, if there is one.

        `network_in_use` is called when a mosaic begins, for the network of its depth.
        """
        self.collection = MosaicCollection(tools.captures.collection.folder / MOSAICS)
        tools.captures.collection.on_delete(self.collection.remove)
        self._captures, self._viewer = tools.captures, viewer
        self._network_in_use = network_in_use
        self._lock = threading.Lock()
        self._shown: str | None = None
        self._making = DerivedProductJobs(DerivedProduct(noun=NOUN, process=PROCESS, make=self._make), tools)

    def start(self, capture_id: str, request: MosaicRequest, *, idempotency_key: str | None = None) -> Job:
        """Queue a mosaic, or the rest of an unfinished one; raise at once when it cannot be computed."""
        return self._making.start(
            capture_id,
            request,
            check=lambda kept: check_room(self._needs(kept, request)),
            idempotency_key=idempotency_key,
        )

    def get(self, capture_id: str) -> MosaicDocument:
        """Return the state of a capture's mosaic and the estimated size of one; raise NotFound."""
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
            scans=[] if kept.dataset is None else list(kept.dataset.scans),
            brackets=brackets_of(kept.dataset),
            in_scene=self._shown == capture_id,
            made=None if made is None else made.describe(capture_id, kept.dataset),
            url=mosaic_url(capture_id),
        )

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
        """Show the mosaic's surface in the 3D scene, replacing another mosaic's."""
        kept, made = self._captures.collection.get(capture_id), self.collection.require(capture_id)
        content = self.collection.file(capture_id, "mesh.glb").read_bytes()
        if self._viewer is None:
            raise NotConnected(
                "there is no 3D scene: it is switched off, or could not be started",
                asked="show a mosaic in 3D",
                found="there is no 3D scene",
                remedy="download mesh.glb and open it elsewhere",
            )
        with self._lock:
            stand, middle = viewpoint_of(made.file.recipe.chart, made.tiles)
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

    def _make(self, kept: StoredCapture, request: str, run: Run) -> str:
        network = self._network_in_use()
        card = "" if network is None else str(network.path)
        run([str(kept.folder), str(self.collection.prepare(kept.id)), request, card])
        self.hide(kept.id)
        self.collection.finish(kept.id)
        return mosaic_url(kept.id)

    def _outlook(self, kept: StoredCapture) -> tuple[MosaicNeedsDocument | None, Problem | None]:
        """Return the estimated size of a mosaic of the left eye, or why none is possible."""
        try:
            needs = self._needs(kept, MosaicRequest())
            check_room(needs)
        except FoveaError as error:
            return None, problem_of(error).document()
        return needs, None

    def _needs(self, kept: StoredCapture, request: MosaicRequest) -> MosaicNeedsDocument:
        return needs_of(self._making.ended_dataset(kept), request, self.collection.folder.parent)


def viewpoint_of(chart: Chart, depth: DepthTilesFile) -> tuple[Point, Point]:
    """Return viewpoint and its target, m, rig frame: before the nearest depth, towards the centre."""
    if depth.near_m is None or depth.far_m is None:
        return (0.0, 0.0, -1.0), (0.0, 0.0, 1.0)
    z_m = (depth.near_m + depth.far_m) / 2
    x, y = (chart.u0_px + chart.width / 2) / chart.f_px, (chart.v0_px + chart.height / 2) / chart.f_px
    across_m = chart.width / chart.f_px * z_m
    eye_z_m = min(NEAREST_SHARE * depth.near_m, z_m - FIT_WIDTHS * across_m)
    lift = LIFT * (z_m - eye_z_m)
    return (x * eye_z_m + lift, y * eye_z_m - lift, eye_z_m), (x * z_m, y * z_m, z_m)


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
    settings = made.file.recipe.settings
    points = [point for point in dataset if point.place.scan == settings.scan]
    usable = [
        point
        for point in points
        if point.pose.volts is not None
        and any(
            frame.role.value == settings.eye and frame.bracket == settings.bracket for frame in point.frames
        )
    ]
    return len(usable) != made.file.figures.views
