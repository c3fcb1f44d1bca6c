"""The 3D scene: draws the rig, its gaze, fixations, measurements and surfaces with a viser server.

Calls from any thread are safe, except from the hardware's: viser packs arrays in the caller's thread, for
milliseconds. viser stores all drawings and sends them to later viewers. A click reports the fixation's id;
the receiver checks permissions.
"""

import asyncio
import logging
import threading
from collections import OrderedDict
from collections.abc import Awaitable, Callable
from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import TypeAlias

import numpy as np
import viser

from foveacam_pipeline.stereo.values import DepthMesh
from foveacam_web.scene_fixation import FixationNode, FixationParts, LimitsNode
from foveacam_web.scene_labels import free_labels
from foveacam_web.scene_lines import MeasurementNode, TrailNode
from foveacam_web.scene_panel import ScenePanel, Viewpoint
from foveacam_web.scene_rig import RigDrawing
from foveacam_web.scene_surroundings import SurroundingsNode, draw_field
from foveacam_web.scene_values import (
    UP,
    EyeGaze,
    FixationDrawing,
    LimitsDrawing,
    MeasurementDrawing,
    Point,
    RigShape,
)
from foveacam_web.scene_viewpoints import START_FOV_RAD, Pose, Viewpoints, pose_at_rig, pose_over
from foveacam_web.viser_server import PrivateViser

MAX_FIXATIONS = 24
"""Number of fixations in the scene; older ones are removed from it (not from the server) to bound viewers'
graphics memory."""
START_POSITION_M = (0.0, -0.45, -1.3)
START_LOOK_AT_M = (0.0, 0.1, 2.5)

OnSelect: TypeAlias = Callable[[str], Awaitable[None]]
_log = logging.getLogger(__name__)


class ViewerScene:
    """The scene and its viser server; `start` opens it, `stop` or leaving the context closes it."""

    def __init__(self, *, view_url: str | None = "/view") -> None:
        self._view_url = view_url
        self._lock = threading.RLock()
        self._private: PrivateViser | None = None
        self._rig: RigDrawing | None = None
        self._panel: ScenePanel | None = None
        self._fixations: OrderedDict[str, FixationNode | LimitsNode] = OrderedDict()
        self._measurements: dict[str, MeasurementNode] = {}
        self._labelled: list[FixationNode | LimitsNode | MeasurementNode] = []
        """Fixations and measurements, whose labels must not cover each other; the newest last."""
        self._trails: dict[str, TrailNode] = {}
        self._field: viser.GlbHandle | None = None
        self._surroundings = SurroundingsNode()
        self._viewpoints = Viewpoints()
        self._overlooks = False
        """Whether the surroundings were found after the newest shape."""
        self._selected: str | None = None
        self._shown = FixationParts()
        self._hand_over: tuple[OnSelect, asyncio.AbstractEventLoop] | None = None

    def __enter__(self) -> "ViewerScene":
        self.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()

    @property
    def socket_path(self) -> Path:
        """Unix socket of the viser server; raises `RuntimeError` when the scene is not started."""
        if self._private is None:
            raise RuntimeError("the 3D scene is not started; call start() first")
        return self._private.socket_path

    @property
    def _server(self) -> viser.ViserServer | None:
        return self._private.server if self._private is not None else None

    def start(self) -> None:
        """Start the server and draw floor and panel; no effect when started."""
        with self._lock:
            if self._server is not None:
                return
            self._private = PrivateViser()
            server = self._private.server
            server.scene.set_up_direction("-y")
            server.scene.configure_environment_map(None)
            server.initial_camera.up = UP
            server.initial_camera.fov = START_FOV_RAD
            self._place_new_viewers()
            self._rig = RigDrawing(server.scene)
            self._rig.draw_floor()
            self._panel = ScenePanel(server, view_url=self._view_url, shown=self._shown)
            self._panel.on_change(shown=self._show, rays=self._show_rays, place=self._place)
            self._viewpoints.open(server)
            self._surroundings.open(server, self._panel.folder)

    def stop(self) -> None:
        """Stop the server and drop all drawings; no effect when stopped."""
        with self._lock:
            private, self._private = self._private, None
            self._rig = self._panel = self._field = None
            self._surroundings.close()
            self._fixations.clear()
            self._measurements.clear()
            self._labelled.clear()
            self._trails.clear()
        # Without the lock, for which a callback on viser's loop may wait
        if private is not None:
            private.close()

    close = stop

    def on_select(self, callback: OnSelect, loop: asyncio.AbstractEventLoop) -> None:
        """Run `callback(fixation_id)` on `loop` when a viewer clicks a fixation."""
        with self._lock:
            self._hand_over = (callback, loop)

    def show_rig(self, shape: RigShape) -> None:
        """Draw the rig: its frame, the wide camera and both foveae."""
        with self._lock:
            if self._rig is not None:
                self._rig.draw(shape)

    def show_gaze(
        self, *, left: EyeGaze | None, right: EyeGaze | None, distance_m: float | None = None
    ) -> None:
        """Turn the foveae; None hides one. Each change goes to all viewers: a few per second at most."""
        with self._lock:
            if self._rig is not None:
                self._rig.look(left=left, right=right, distance_m=distance_m)

    def show_fixation(self, fixation_id: str, drawing: FixationDrawing) -> None:
        """Add or replace a fixation, and lead viewers to it."""
        with self._lock:
            if self._server is None or self._panel is None:
                return
            if drawing.mesh is None and drawing.cloud is not None:
                self._shown = self._panel.show_clouds()  # a fixation without a mesh shows its cloud
            self._drop(fixation_id)
            with self._server.atomic():
                node = FixationNode(self._server.scene, fixation_id, drawing, shown=self._shown)
            node.clickable(self._clicked)
            self._overlooks = self._overlooks and not node.has_shape
            self._add(fixation_id, node)
            if self._panel.follows:
                self._viewpoints.lead_all(node.pose)

    def show_limits(self, fixation_id: str, drawing: LimitsDrawing) -> None:
        """Add or replace a fixation with only limits of its distance."""
        with self._lock:
            if self._server is None:
                return
            self._drop(fixation_id)
            with self._server.atomic():
                node = LimitsNode(self._server.scene, fixation_id, drawing, shown=self._shown)
            node.clickable(self._clicked)
            self._add(fixation_id, node)

    def relabel_fixation(self, fixation_id: str, label: str) -> None:
        """Give a fixation another name; no effect when there is none of that id."""
        with self._lock:
            node = self._fixations.get(fixation_id)
            if node is not None:
                node.relabel(label)

    def remove_fixation(self, fixation_id: str) -> None:
        """Remove a fixation; no effect when there is none of that id."""
        with self._lock:
            self._drop(fixation_id)
            if self._selected == fixation_id:
                self._selected = None
            self._show_parts()

    def show_measurement(self, measurement_id: str, drawing: MeasurementDrawing) -> None:
        """Add or replace a measurement."""
        with self._lock:
            if self._server is None:
                return
            self.remove_measurement(measurement_id)
            with self._server.atomic():
                node = MeasurementNode(self._server.scene, measurement_id, drawing)
            self._measurements[measurement_id] = node
            self._labelled.append(node)
            self._show_parts()

    def remove_measurement(self, measurement_id: str) -> None:
        """Remove a measurement; no effect when there is none of that id."""
        with self._lock:
            node = self._measurements.pop(measurement_id, None)
            if node is not None:
                self._labelled.remove(node)
                node.remove()
                self._show_parts()

    def show_trail(self, target_id: str, label: str, points_rig_m: list[Point]) -> None:
        """Add or replace the trail of a followed target, oldest point first, m, rig frame."""
        with self._lock:
            if self._server is None or not points_rig_m:
                return
            earlier = self._trails.get(target_id)
            with self._server.atomic():
                if earlier is None:
                    self._trails[target_id] = TrailNode(self._server.scene, target_id, label, points_rig_m)
                else:
                    earlier.extend(label, points_rig_m)

    def remove_trail(self, target_id: str) -> None:
        """Remove a trail; no effect when there is none of that id."""
        with self._lock:
            node = self._trails.pop(target_id, None)
            if node is not None:
                node.remove()

    def show_field(self, content: bytes, *, from_rig_m: Point, to_rig_m: Point) -> None:
        """Draw a mosaic's surface (GLB file, +y up, m) in place of an earlier one, and turn viewers to it."""
        with self._lock:
            if self._server is None:
                return
            self.remove_field()
            self._field = draw_field(self._server.scene, content)
            self._viewpoints.lead_all(
                Pose(position_m=np.asarray(from_rig_m), look_at_m=np.asarray(to_rig_m)), asked=True
            )

    def remove_field(self) -> None:
        """Remove the mosaic's surface; no effect when there is none."""
        with self._lock:
            field, self._field = self._field, None
            if field is not None:
                field.remove()

    def show_surroundings(self, mesh: DepthMesh, backdrop: DepthMesh, *, bring: bool = False) -> None:
        """Draw the wide view in place of an older one; `bring`: turn viewers to it that nobody has moved.

        `mesh`: where it was measured; `backdrop`: all of it, interpolated between what was.
        """
        self._surroundings.show(mesh, backdrop)
        with self._lock:
            self._overlooks = self._overlooks or bring
            if self._rig is not None:
                self._rig.show_floor(visible=False)
            self._place_new_viewers()
            if bring and self._surroundings.outlook is not None:
                self._viewpoints.lead_all(self._surroundings.outlook)

    def remove_surroundings(self) -> None:
        """Remove the wide view's surface; no effect when there is none."""
        self._surroundings.remove()
        with self._lock:
            if self._rig is not None:
                self._rig.show_floor(visible=True)
            self._place_new_viewers()

    def select(self, fixation_id: str | None) -> None:
        """Highlight one fixation, or none with None."""
        with self._lock:
            self._selected = fixation_id
            for name, node in self._fixations.items():
                node.select(selected=name == fixation_id)
            self._show_parts()

    def _drop(self, fixation_id: str) -> None:
        node = self._fixations.pop(fixation_id, None)
        if node is not None:
            self._labelled.remove(node)
            node.remove()
            self._place_new_viewers()

    def _place_new_viewers(self) -> None:
        """Let a viewer that connects begin before what was found last: a shape, or the surroundings."""
        if self._server is None:
            return
        found = [
            node.pose
            for node in self._fixations.values()
            if isinstance(node, FixationNode) and node.has_shape
        ]
        whole = self._surroundings.outlook
        start = Pose(position_m=np.asarray(START_POSITION_M), look_at_m=np.asarray(START_LOOK_AT_M))
        pose = whole if whole is not None and (self._overlooks or not found) else [start, *found][-1]
        camera = self._server.initial_camera
        camera.position, camera.look_at, camera.fov = pose.position_m, pose.look_at_m, pose.fov_rad

    async def _place(self, viewer: viser.ClientHandle, viewpoint: Viewpoint) -> None:
        """Move a viewer to the view that was asked for."""
        with self._lock:
            pose = self._pose(viewpoint)
        if pose is not None:
            await self._viewpoints.place(viewer, pose)

    def _pose(self, viewpoint: Viewpoint) -> Pose | None:
        if viewpoint == "rig":
            return pose_at_rig(None if self._rig is None else self._rig.shape)
        if viewpoint == "target":
            newest = next(reversed(self._fixations), None)
            node = self._fixations.get(self._selected or newest or "")
            return None if node is None else node.pose
        points_m = [node.point_rig_m for node in self._fixations.values()]
        whole = self._surroundings.outlook
        if whole is not None and self._overlooks:
            return whole
        return pose_over(points_m) if points_m else whole

    def _add(self, fixation_id: str, node: FixationNode | LimitsNode) -> None:
        self._fixations[fixation_id] = node
        self._labelled.append(node)
        node.select(selected=fixation_id == self._selected)
        while len(self._fixations) > MAX_FIXATIONS:
            oldest = next(name for name in self._fixations if name != self._selected)
            self._drop(oldest)
        self._place_new_viewers()
        self._show_parts()

    def _show_parts(self) -> None:
        """Set what is visible; of labels that would cover each other, seen from the rig, only the newest."""
        selected = self._fixations.get(self._selected or "")
        newest_first = self._labelled[::-1]
        newest_first.sort(key=lambda node: node is not selected)
        labelled = free_labels([(node, node.label_rig_m) for node in newest_first])
        for node in self._labelled:
            node.show(replace(self._shown, labels=self._shown.labels and node in labelled))

    def _show(self, shown: FixationParts) -> None:
        with self._lock:
            self._shown = shown
            self._show_parts()

    def _show_rays(self, visible: bool) -> None:  # the only argument, named by the method
        with self._lock:
            if self._rig is not None:
                self._rig.show_rays(visible=visible)

    async def _clicked(self, fixation_id: str) -> None:
        """Select the fixation and schedule the callback of `on_select` on its loop; runs on viser's loop."""
        self.select(fixation_id)
        if self._hand_over is None:
            return
        callback, loop = self._hand_over

        async def run() -> None:
            await callback(fixation_id)

        call = run()
        try:
            asyncio.run_coroutine_threadsafe(call, loop).add_done_callback(_report)
        except RuntimeError:  # the server's loop has closed
            call.close()


def _report(done: "Future[None]") -> None:
    if not done.cancelled() and done.exception() is not None:
        _log.error("a request to the 3D scene came to nothing", exc_info=done.exception())
