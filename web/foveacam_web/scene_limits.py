"""A fixation without a distance in the 3D scene: the part of its line of sight that its limits leave."""

import numpy as np
import viser

from foveacam_web.scene_fixation import Clicked, FixationParts
from foveacam_web.scene_values import LIMITS_COLOR, SELECTED_COLOR, LimitsDrawing

_MARKER_PER_DISTANCE = 0.004


class LimitsNode:
    """The handles of one such fixation; created drawn, gone after `remove`."""

    def __init__(
        self, scene: viser.SceneApi, fixation_id: str, drawing: LimitsDrawing, *, shown: FixationParts
    ) -> None:
        self._id = fixation_id
        self._root = scene.add_frame(f"/fixations/{fixation_id}", show_axes=False)
        ends_m = drawing.ends_rig_m()
        self._nearest_m = ends_m[0]
        self._line = scene.add_line_segments(
            f"{self._root.name}/limits",
            (ends_m - ends_m[0])[None].astype(np.float32),
            LIMITS_COLOR,
            thickness=3.0,
            thickness_units="screen",
            position=ends_m[0],
        )
        closed = ends_m if drawing.farthest_m is not None else ends_m[:1]
        self._markers = [
            scene.add_icosphere(
                f"{self._root.name}/limit{index}",
                radius=_MARKER_PER_DISTANCE * float(np.linalg.norm(end_m)),
                color=LIMITS_COLOR,
                wireframe=True,
                position=end_m,
                cast_shadow=False,
                receive_shadow=False,
            )
            for index, end_m in enumerate(closed)
        ]
        self._label = scene.add_label(
            f"{self._root.name}/label", drawing.text, position=ends_m[0], anchor="bottom-center"
        )
        self.show(shown)

    @property
    def point_rig_m(self) -> tuple[float, float, float]:
        """Where the line begins, for the camera of a viewer."""
        x_m, y_m, z_m = self._nearest_m.tolist()
        return x_m, y_m, z_m

    def clickable(self, clicked: Clicked) -> None:
        """Call `clicked(id)` on viser's loop when a limit is clicked; it must only hand over."""

        async def on_click(_event: object) -> None:
            await clicked(self._id)

        for marker in self._markers:
            marker.on_click(on_click)

    def show(self, shown: FixationParts) -> None:
        """Show and hide the label; the line stays, it is all there is."""
        self._label.visible = shown.labels

    def select(self, *, selected: bool) -> None:
        """Mark or unmark the fixation as the one that the operator works with."""
        for marker in self._markers:
            marker.color = SELECTED_COLOR if selected else LIMITS_COLOR
        self._label.font_screen_scale = 1.25 if selected else 1.0

    def remove(self) -> None:
        """Take everything away."""
        self._root.remove()
