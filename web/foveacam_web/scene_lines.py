"""Draws lines with a value in the 3D scene: measurements, and the trails of followed targets."""

import numpy as np
import viser
from numpy.typing import NDArray

from foveacam_web.scene_fixation import FixationParts
from foveacam_web.scene_values import MEASURE_COLOR, MeasurementDrawing, Point, Rgb, short

TRAIL_COLOR: Rgb = (214, 64, 159)
_END_PER_DISTANCE = 0.0015
"""Sphere radius as a share of the distance; smaller than a fixation's, as ends may lie 1 cm apart."""
_NEWEST_PER_DISTANCE = 0.006
_LABEL_RISE_PER_DISTANCE = 0.03


class MeasurementNode:
    """One measurement, drawn at construction: its points, the line or outline between them, its value."""

    def __init__(self, scene: viser.SceneApi, measurement_id: str, drawing: MeasurementDrawing) -> None:
        self._scene = scene
        self._root = scene.add_frame(f"/measurements/{measurement_id}", show_axes=False)
        for number, point_rig_m in enumerate(drawing.points_rig_m):
            radius_m = _END_PER_DISTANCE * float(np.linalg.norm(point_rig_m))
            _add_ball(
                scene,
                f"{self._root.name}/end{number}",
                at=np.array(point_rig_m),
                radius_m=radius_m,
                color=MEASURE_COLOR,
            )
        self._draw_lines(drawing)
        x_m, y_m, z_m = np.array(drawing.points_rig_m).mean(axis=0).tolist()
        self.label_rig_m: Point = (x_m, y_m, z_m)
        self._label = self._draw_label(drawing)

    def show(self, shown: FixationParts) -> None:
        """Set whether the value is visible; the lines always are."""
        self._label.visible = shown.labels

    def remove(self) -> None:
        """Remove its parts from the scene."""
        self._root.remove()

    def _draw_lines(self, drawing: MeasurementDrawing) -> None:
        if len(drawing.points_rig_m) < 2:
            return
        points_m = np.array(drawing.points_rig_m)
        centre_m = points_m.mean(axis=0)  # viser sends float16, which is precise around the centre
        ends = np.roll(points_m, -1, axis=0)
        pairs = np.stack((points_m, ends), axis=1) - centre_m
        lines = (pairs if drawing.closed else pairs[:-1]).astype(np.float32)
        _add_lines(self._scene, f"{self._root.name}/lines", lines, about=centre_m, color=MEASURE_COLOR)

    def _draw_label(self, drawing: MeasurementDrawing) -> viser.LabelHandle:
        return self._scene.add_label(
            f"{self._root.name}/label", drawing.label, position=self.label_rig_m, anchor="bottom-center"
        )


class TrailNode:
    """The trail of one target, drawn at construction and again with every change.

    A line connects its past places; marker and label are at its present one.
    """

    def __init__(self, scene: viser.SceneApi, target_id: str, label: str, points_rig_m: list[Point]) -> None:
        self._scene = scene
        self._root = scene.add_frame(f"/follows/{target_id}", show_axes=False)
        self._draw(label, points_rig_m)

    def extend(self, label: str, points_rig_m: list[Point]) -> None:
        """Draw the present trail."""
        self._draw(label, points_rig_m)

    def remove(self) -> None:
        """Remove it from the scene."""
        self._root.remove()

    def _draw(self, label: str, points_rig_m: list[Point]) -> None:
        points = np.asarray(points_rig_m, dtype=np.float64)
        newest = points[-1]
        distance_m = float(np.linalg.norm(newest))
        if len(points) > 1:
            name, pieces = f"{self._root.name}/line", trail_segments(points)
            _add_lines(self._scene, name, pieces, about=np.zeros(3), color=TRAIL_COLOR)
        _add_ball(
            self._scene,
            f"{self._root.name}/marker",
            at=newest,
            radius_m=_NEWEST_PER_DISTANCE * distance_m,
            color=TRAIL_COLOR,
        )
        above = newest - np.array([0.0, _LABEL_RISE_PER_DISTANCE * distance_m, 0.0])
        self._scene.add_label(
            f"{self._root.name}/label",
            f"{short(label)}  {distance_m:.2f} m",
            position=above,
            anchor="bottom-center",
        )


def trail_segments(points_rig_m: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return the pieces of the line through (n, 3) points, (n - 1, 2, 3) float32."""
    return np.stack([points_rig_m[:-1], points_rig_m[1:]], axis=1).astype(np.float32)


def _add_ball(
    scene: viser.SceneApi, name: str, *, at: NDArray[np.float64], radius_m: float, color: Rgb
) -> None:
    scene.add_icosphere(
        name, radius=radius_m, color=color, position=at, cast_shadow=False, receive_shadow=False
    )


def _add_lines(
    scene: viser.SceneApi, name: str, ends_m: NDArray[np.float32], *, about: NDArray[np.float64], color: Rgb
) -> None:
    """Add lines, (n, 2, 3) m from the point `about`, (3,) m, rig frame."""
    scene.add_line_segments(name, ends_m, color, thickness=3.0, thickness_units="screen", position=about)
