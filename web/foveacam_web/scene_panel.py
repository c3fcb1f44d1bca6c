"""The panels of the 3D scene: camera views docked at the left, checkboxes of what is shown at the right."""

from collections.abc import Callable, Coroutine
from dataclasses import replace
from typing import Literal, TypeAlias

import viser

from foveacam_web.scene_fixation import FixationParts

VIEW_PANEL_WIDTH_PX = 440
_VIEW_FRAME = (
    '<iframe loading="lazy" src="{url}" title="Camera views" data-foveacam-views '
    'style="display:block;width:100%;height:72vh;border:0;background:#111"></iframe>'
)
_HINT = (
    "Click a surface or its marker to select the target. Drag to turn, scroll to come closer. "
    "Grey: not measured, interpolated between what is."
)
Viewpoint: TypeAlias = Literal["everything", "rig", "target"]
Place: TypeAlias = Callable[[viser.ClientHandle, Viewpoint], Coroutine[None, None, None]]

_Pressed: TypeAlias = "viser.GuiEvent[viser.GuiButtonHandle] | viser.CommandEvent"


class ScenePanel:
    """viser's GUI elements; changes reach the scene by the callbacks of `on_change`."""

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
        self._buttons: dict[Viewpoint, viser.GuiButtonHandle] = {
            "everything": gui.add_button("Fit", hint="All that was found (Alt+F)"),
            "rig": gui.add_button("From the rig", hint="As the wide camera sees it (Alt+R)"),
            "target": gui.add_button("Look at the target"),
        }
        # the console, whose low pane hides the buttons, presses these keys
        self._commands: dict[Viewpoint, viser.CommandHandle] = {
            "everything": gui.add_command("Fit all that was found", hotkey="F", modifier="alt"),
            "rig": gui.add_command("See it from the rig", hotkey="R", modifier="alt"),
        }
        gui.add_markdown(_HINT)

    def on_change(
        self,
        *,
        shown: Callable[[FixationParts], None],
        rays: Callable[[bool], None],
        place: Place,
    ) -> None:
        """Register callbacks; they run on viser's loop and must not block."""

        async def changed(_event: object) -> None:
            self._shown = FixationParts(
                surface=self._surface.value, cloud=self._cloud.value, labels=self._labels.value
            )
            shown(self._shown)

        async def rays_changed(_event: object) -> None:
            rays(self._rays.value)

        def taking(viewpoint: Viewpoint) -> Callable[["_Pressed"], Coroutine[None, None, None]]:
            async def take(event: "_Pressed") -> None:
                if event.client is not None:
                    await place(event.client, viewpoint)

            return take

        for checkbox in (self._surface, self._cloud, self._labels):
            checkbox.on_update(changed)
        self._rays.on_update(rays_changed)
        for viewpoint, button in self._buttons.items():
            button.on_click(taking(viewpoint))
        for viewpoint, command in self._commands.items():
            command.on_trigger(taking(viewpoint))

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
