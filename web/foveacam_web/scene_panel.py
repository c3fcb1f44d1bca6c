"""The panels of the 3D scene: camera views docked at the left, checkboxes of what is shown at the right."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import viser
from numpy.typing import NDArray

from foveacam_web.scene_fixation import FixationParts
from foveacam_web.scene_values import UP, Point

VIEW_PANEL_WIDTH_PX = 440
_VIEW_FRAME = (
    '<iframe loading="lazy" src="{url}" title="Camera views" data-foveacam-views '
    'style="display:block;width:100%;height:72vh;border:0;background:#111"></iframe>'
)
_HINT = "Click a surface or its marker to select the target. Drag to turn, scroll to come closer."
_STAND_OFF = 0.12
"""Distance of a viewer's camera from a target as a share of the target's (a fovea's view is 0.05 wide)."""
_ASIDE = (0.03, -0.03)
"""Offset to the right and up (y down), same unit: seen straight on, a surface looks flat."""


class ScenePanel:
    """viser's GUI elements; changes reach the scene by the three callbacks of `on_change`."""

    def __init__(self, server: viser.ViserServer, *, view_url: str | None, shown: FixationParts) -> None:
        self._shown = shown
        gui = server.gui
        gui.configure_theme(dark_mode=False, show_logo=False, show_share_button=False)
        if view_url is not None:
            views = gui.add_panel()
            with views.add_tab("Camera views"):
                gui.add_html(_VIEW_FRAME.format(url=view_url))
            views.dock_left()
            views.set_width(VIEW_PANEL_WIDTH_PX)
        self.folder = gui.add_folder("Show")
        """Folder to which other parts of the scene add their checkboxes."""
        with self.folder:
            self._surface = gui.add_checkbox("Surfaces", shown.surface)
            self._cloud = gui.add_checkbox("Point clouds", shown.cloud)
            self._labels = gui.add_checkbox("Labels", shown.labels)
            self._rays = gui.add_checkbox("Gaze rays", initial_value=True)
            self._follow = gui.add_checkbox("Follow targets", initial_value=True)
        self._look = gui.add_button("Look at the target")
        gui.add_markdown(_HINT)

    def on_change(
        self,
        *,
        shown: Callable[[FixationParts], None],
        rays: Callable[[bool], None],
        selected_point: Callable[[], Point | None],
    ) -> None:
        """Register callbacks; they run on viser's loop and must not block."""

        async def changed(_event: object) -> None:
            self._shown = FixationParts(
                surface=self._surface.value, cloud=self._cloud.value, labels=self._labels.value
            )
            shown(self._shown)

        async def rays_changed(_event: object) -> None:
            rays(self._rays.value)

        async def look(event: "viser.GuiEvent[viser.GuiButtonHandle]") -> None:
            point_m = selected_point()
            if event.client is not None and point_m is not None:
                approach(event.client, point_m)

        for checkbox in (self._surface, self._cloud, self._labels):
            checkbox.on_update(changed)
        self._rays.on_update(rays_changed)
        self._look.on_click(look)

    @property
    def follows(self) -> bool:
        """Whether viewers' cameras follow the newest fixation."""
        return self._follow.value

    def show_clouds(self) -> FixationParts:
        """Switch the point clouds on; return the parts shown then."""
        if not self._cloud.value:
            self._cloud.value = True  # type: ignore[misc]  # viser's setter, which mypy does not see
            self._shown = replace(self._shown, cloud=True)
        return self._shown


def pose_before(point_rig_m: Point) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return where a viewer stands in front of a point and what it looks at, (3,) each, m, rig frame.

    Slightly above and to the right of the line of sight, so close that a fovea fills half of the view.
    """
    point_m = np.asarray(point_rig_m, dtype=np.float64)
    aside_m = float(np.linalg.norm(point_m)) * np.array([*_ASIDE, 0.0])
    return (1.0 - _STAND_OFF) * point_m + aside_m, point_m


def approach(client: viser.ClientHandle, point_rig_m: Point) -> None:
    """Move one viewer's camera in front of a point, m, rig frame."""
    position_m, look_at_m = pose_before(point_rig_m)
    with client.atomic():
        client.camera.up_direction = UP
        client.camera.position = position_m
        client.camera.look_at = look_at_m
