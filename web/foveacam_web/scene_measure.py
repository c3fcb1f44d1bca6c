"""Draws one measurement in the 3D scene: its points, the line or outline between them, and its value."""

import numpy as np
import viser

from foveacam_web.scene_values import MEASURE_COLOR, MeasurementDrawing

_MARKER_PER_DISTANCE = 0.0015
"""Sphere radius as a share of the distance; smaller than a fixation's, as ends may lie 1 cm apart."""


class MeasurementNode:
    """One measurement, drawn at construction."""

    def __init__(self, scene: viser.SceneApi, measurement_id: str, drawing: MeasurementDrawing) -> None:
        self._scene = scene
        self._root = scene.add_frame(f"/measurements/{measurement_id}", show_axes=False)
        self._draw_ends(drawing)
        self._draw_lines(drawing)
        self._label = self._draw_label(drawing)

    def show_label(self, *, visible: bool) -> None:
        """Set whether the value is visible."""
        self._label.visible = visible

    def remove(self) -> None:
        """Remove all of it from the scene."""
        self._root.remove()

    def _draw_ends(self, drawing: MeasurementDrawing) -> None:
        for number, point_rig_m in enumerate(drawing.points_rig_m):
            self._scene.add_icosphere(
                f"{self._root.name}/end{number}",
                radius=_MARKER_PER_DISTANCE * float(np.linalg.norm(point_rig_m)),
                color=MEASURE_COLOR,
                position=point_rig_m,
                cast_shadow=False,
                receive_shadow=False,
            )

    def _draw_lines(self, drawing: MeasurementDrawing) -> None:
        if len(drawing.points_rig_m) < 2:
            return
        points_m = np.array(drawing.points_rig_m)
        centre_m = points_m.mean(axis=0)  # viser sends float16, which is precise around the centre
        ends = np.roll(points_m, -1, axis=0)
        pairs = np.stack((points_m, ends), axis=1) - centre_m
        self._scene.add_line_segments(
            f"{self._root.name}/lines",
            (pairs if drawing.closed else pairs[:-1]).astype(np.float32),
            MEASURE_COLOR,
            thickness=3.0,
            thickness_units="screen",
            position=centre_m,
        )

    def _draw_label(self, drawing: MeasurementDrawing) -> viser.LabelHandle:
        x_m, y_m, z_m = np.array(drawing.points_rig_m).mean(axis=0).tolist()
        return self._scene.add_label(
            f"{self._root.name}/label", drawing.label, position=(x_m, y_m, z_m), anchor="bottom-center"
        )
