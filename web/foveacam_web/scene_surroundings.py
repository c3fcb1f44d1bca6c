"""Draws the surfaces behind the fixations: that of the wide view, coarse, and that of a mosaic, fused."""

import threading

import numpy as np
import viser

from foveacam_pipeline.stereo.values import DepthMesh
from foveacam_web.glb import write_glb
from foveacam_web.scene_viewpoints import Pose

_HALF_TURN_ABOUT_X = (0.0, 1.0, 0.0, 0.0)
"""wxyz: GLB files for other programs are +y up, the rig frame is +y down."""
_NEAR_QUANTILE, _MIDDLE_QUANTILE = 0.02, 0.5
_STAND = (0.22, -0.16, 0.3)
"""Camera position (x right, y down, z forward) that shows the surface, in units of its nearest depth."""


class SurroundingsNode:
    """The coarse surface of the wide view and its checkbox; thread-safe, without effect while closed."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._server: viser.ViserServer | None = None
        self._switch: viser.GuiCheckboxHandle | None = None
        self._surface: viser.GlbHandle | None = None
        self._backdrop: viser.GlbHandle | None = None
        self.outlook: Pose | None = None
        """The pose that shows all of it; None without a surface."""

    def open(self, server: viser.ViserServer, folder: viser.GuiFolderHandle) -> None:
        """Add the checkbox to a folder of the panel."""
        with self._lock:
            self._server = server
            with folder:
                self._switch = server.gui.add_checkbox("Surroundings", initial_value=True)

        async def changed(_event: object) -> None:
            self._apply()

        self._switch.on_update(changed)

    def close(self) -> None:
        """Drop the handles; the caller closes the server."""
        with self._lock:
            self._server = self._switch = self._surface = self._backdrop = self.outlook = None

    def show(self, mesh: DepthMesh, backdrop: DepthMesh) -> None:
        """Draw what was measured, and what lies between it, in place of older ones; meshes in m, rig frame.

        A mesh without faces is not drawn.
        """
        measured = write_glb(mesh) if len(mesh.faces) else None
        between = write_glb(backdrop)
        with self._lock:
            if self._server is None or self._switch is None:
                return
            scene, visible = self._server.scene, self._switch.value
            self._backdrop = _draw(scene, "/backdrop", between, visible=visible)
            if measured is not None:
                self._surface = _draw(scene, "/surroundings", measured, visible=visible)
                self.outlook = outlook(mesh)
            elif self._surface is not None:
                self._surface.remove()
                self._surface = self.outlook = None

    def remove(self) -> None:
        """Remove the surface from the scene."""
        with self._lock:
            drawn = [self._surface, self._backdrop]
            self._surface = self._backdrop = self.outlook = None
            for each in drawn:
                if each is not None:
                    each.remove()

    def _apply(self) -> None:
        with self._lock:
            for each in (self._surface, self._backdrop):
                if each is not None and self._switch is not None:
                    each.visible = self._switch.value


def _draw(scene: viser.SceneApi, name: str, content: bytes, *, visible: bool) -> viser.GlbHandle:
    return scene.add_glb(name, content, cast_shadow=False, receive_shadow=False, visible=visible)


def outlook(mesh: DepthMesh) -> Pose:
    """Return the pose from which a mesh is seen whole."""
    near_m, middle_m = np.quantile(mesh.vertices_rig_m[:, 2], (_NEAR_QUANTILE, _MIDDLE_QUANTILE)).tolist()
    x_m, y_m = mesh.vertices_rig_m[:, :2].mean(axis=0).tolist()
    return Pose(position_m=near_m * np.asarray(_STAND), look_at_m=np.array([x_m, y_m, middle_m]))


def draw_field(scene: viser.SceneApi, content: bytes) -> viser.GlbHandle:
    """Draw the fused surface of a mosaic: a GLB file, +y up, metres."""
    return scene.add_glb("/field", content, wxyz=_HALF_TURN_ABOUT_X, cast_shadow=False, receive_shadow=False)
