"""The coarse surface of the whole wide view in the 3D scene, and its switch."""

import threading

import numpy as np
import viser

from foveacam_pipeline.stereo.values import DepthMesh
from foveacam_web.glb import write_glb
from foveacam_web.scene_field import Point, overlook

_NAME = "/surroundings"
_NEAR_QUANTILE, _MIDDLE_QUANTILE = 0.02, 0.5
_STAND = (0.22, -0.16, 0.3)
"""Where viewers stand to see it: to the right, up (y down) and forward, as parts of the nearest depth."""


class SurroundingsNode:
    """Shows one surface at a time; callable from any thread, harmless while closed."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._server: viser.ViserServer | None = None
        self._switch: viser.GuiCheckboxHandle | None = None
        self._surface: viser.GlbHandle | None = None

    def open(self, server: viser.ViserServer, folder: viser.GuiFolderHandle) -> None:
        """Add the switch to a folder of the panel."""
        with self._lock:
            self._server = server
            with folder:
                self._switch = server.gui.add_checkbox("Surroundings", initial_value=True)

        async def changed(_event: object) -> None:
            self._apply()

        self._switch.on_update(changed)

    def close(self) -> None:
        """Forget what was drawn; the server goes with it."""
        with self._lock:
            self._server = self._switch = self._surface = None

    def show(self, mesh: DepthMesh, *, bring: bool = False) -> None:
        """Draw a surface, rig frame, in place of an older one; `bring`: let the viewers look at it."""
        content = write_glb(mesh)
        with self._lock:
            if self._server is None or self._switch is None:
                return
            self._surface = self._server.scene.add_glb(
                _NAME, content, cast_shadow=False, receive_shadow=False, visible=self._switch.value
            )
            stand, middle = outlook(mesh)
            self._server.initial_camera.position = stand
            self._server.initial_camera.look_at = middle
            if bring:
                for viewer in self._server.get_clients().values():
                    overlook(viewer, from_rig_m=stand, to_rig_m=middle)

    def remove(self) -> None:
        """Take the surface away."""
        with self._lock:
            surface, self._surface = self._surface, None
            if surface is not None:
                surface.remove()

    def _apply(self) -> None:
        with self._lock:
            if self._surface is not None and self._switch is not None:
                self._surface.visible = self._switch.value


def outlook(mesh: DepthMesh) -> tuple[Point, Point]:
    """Return where to stand and where to look, m, rig frame, so that all of a surface is seen."""
    near_m, middle_m = np.quantile(mesh.vertices_rig_m[:, 2], (_NEAR_QUANTILE, _MIDDLE_QUANTILE)).tolist()
    x_m, y_m = mesh.vertices_rig_m[:, :2].mean(axis=0).tolist()
    return (
        (_STAND[0] * near_m, _STAND[1] * near_m, _STAND[2] * near_m),
        (float(x_m), float(y_m), float(middle_m)),
    )
