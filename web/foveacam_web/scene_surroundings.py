"""Draws the surfaces behind the fixations: that of the wide view, coarse, and that of a mosaic, fused."""

import threading

import numpy as np
import viser

from foveacam_pipeline.stereo.values import DepthMesh
from foveacam_web.glb import write_glb
from foveacam_web.scene_viewpoints import FOV_OVER_ALL_RAD, Pose

_HALF_TURN_ABOUT_X = (0.0, 1.0, 0.0, 0.0)
"""wxyz: GLB files for other programs are +y up, the rig frame is +y down."""
_MIDDLE_QUANTILE = 0.5
_STAND = (0.05, -0.035, 0.05)
"""Camera position (x right, y down, z forward) that shows the surface, in units of its middle depth: little
aside, because near and far are torn apart when seen from the side."""
_EDGE_QUANTILE, _FILLS = 0.02, 0.9
"""Share of the surface's points left out at each edge, and of the view's height that the rest fills."""


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
    """Return the pose from which a mesh is seen whole, near the rig's own."""
    points_m = mesh.vertices_rig_m.astype(np.float64)
    middle_m = np.quantile(points_m, _MIDDLE_QUANTILE, axis=0)
    position_m = float(middle_m[2]) * np.asarray(_STAND)
    seen_m = points_m - position_m
    low, high = np.quantile(
        seen_m[:, 1] / np.maximum(seen_m[:, 2], 1e-3), (_EDGE_QUANTILE, 1.0 - _EDGE_QUANTILE)
    ).tolist()
    x_m, y_m, z_m = (
        points_m[:, 0].mean(),
        (low + high) / 2.0 * float(middle_m[2]) + position_m[1],
        middle_m[2],
    )
    return Pose(
        position_m=position_m,
        look_at_m=np.array([x_m, y_m, z_m]),
        fov_rad=float(np.clip(2.0 * np.arctan((high - low) / 2.0 / _FILLS), *FOV_OVER_ALL_RAD)),
    )


def draw_field(scene: viser.SceneApi, content: bytes) -> viser.GlbHandle:
    """Draw the fused surface of a mosaic: a GLB file, +y up, metres."""
    return scene.add_glb("/field", content, wxyz=_HALF_TURN_ABOUT_X, cast_shadow=False, receive_shadow=False)
