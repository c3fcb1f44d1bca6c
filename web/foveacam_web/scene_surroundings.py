"""Draws the surfaces behind the fixations: that of the wide view, coarse, and that of a mosaic, fused."""

import threading

import numpy as np
import viser

from foveacam_pipeline.stereo.values import DepthMesh
from foveacam_web.glb import write_glb
from foveacam_web.scene_values import UP, Point

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
        self.outlook: tuple[Point, Point] | None = None
        """Camera position and look-at point, m, rig frame, that show all of it; None without a surface."""

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
            self._server = self._switch = self._surface = self.outlook = None

    def show(self, mesh: DepthMesh, *, bring: bool = False) -> None:
        """Draw a mesh (rig frame, m) in place of an older one; `bring`: turn all viewers to it."""
        content = write_glb(mesh)
        with self._lock:
            if self._server is None or self._switch is None:
                return
            self._surface = self._server.scene.add_glb(
                "/surroundings", content, cast_shadow=False, receive_shadow=False, visible=self._switch.value
            )
            self.outlook = stand, middle = outlook(mesh)
            if bring:
                for viewer in self._server.get_clients().values():
                    overlook(viewer, from_rig_m=stand, to_rig_m=middle)

    def remove(self) -> None:
        """Remove the surface from the scene."""
        with self._lock:
            surface, self._surface = self._surface, None
            self.outlook = None
            if surface is not None:
                surface.remove()

    def _apply(self) -> None:
        with self._lock:
            if self._surface is not None and self._switch is not None:
                self._surface.visible = self._switch.value


def outlook(mesh: DepthMesh) -> tuple[Point, Point]:
    """Return the camera's position and its look-at point, m, rig frame, from which a mesh is seen whole."""
    near_m, middle_m = np.quantile(mesh.vertices_rig_m[:, 2], (_NEAR_QUANTILE, _MIDDLE_QUANTILE)).tolist()
    x_m, y_m = mesh.vertices_rig_m[:, :2].mean(axis=0).tolist()
    return (
        (_STAND[0] * near_m, _STAND[1] * near_m, _STAND[2] * near_m),
        (float(x_m), float(y_m), float(middle_m)),
    )


def draw_field(scene: viser.SceneApi, content: bytes) -> viser.GlbHandle:
    """Draw the fused surface of a mosaic: a GLB file, +y up, metres."""
    return scene.add_glb("/field", content, wxyz=_HALF_TURN_ABOUT_X, cast_shadow=False, receive_shadow=False)


def overlook(client: viser.ClientHandle, *, from_rig_m: Point, to_rig_m: Point) -> None:
    """Move one viewer's camera to `from_rig_m`, looking at `to_rig_m` (m, rig frame)."""
    with client.atomic():
        client.camera.up_direction = UP
        client.camera.position = from_rig_m
        client.camera.look_at = to_rig_m
