"""The coarse surface of the whole wide view in the 3D scene, and its switch."""

import threading

import viser

from foveacam_pipeline.stereo.values import DepthMesh
from foveacam_web.glb import write_glb

_NAME = "/surroundings"


class Surroundings:
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

    def show(self, mesh: DepthMesh) -> None:
        """Draw a surface, rig frame, in place of an older one."""
        content = write_glb(mesh)
        with self._lock:
            if self._server is None or self._switch is None:
                return
            self._surface = self._server.scene.add_glb(
                _NAME, content, cast_shadow=False, receive_shadow=False, visible=self._switch.value
            )

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
