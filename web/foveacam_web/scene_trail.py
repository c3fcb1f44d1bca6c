"""Draws the trail of one followed target: a line through where it was, a marker and a label where it is."""

import numpy as np
import viser
from numpy.typing import NDArray

from foveacam_web.scene_values import Point, short

TRAIL_COLOR = (214, 64, 159)
_MARKER_PER_DISTANCE = 0.006
_LABEL_RISE_PER_DISTANCE = 0.03


class TrailNode:
    """The trail of one target, drawn at construction and drawn anew with every change."""

    def __init__(self, scene: viser.SceneApi, target_id: str, label: str, points_rig_m: list[Point]) -> None:
        self._scene = scene
        self._root = scene.add_frame(f"/follows/{target_id}", show_axes=False)
        self._draw(label, points_rig_m)

    def extend(self, label: str, points_rig_m: list[Point]) -> None:
        """Draw the trail as it is now."""
        self._draw(label, points_rig_m)

    def remove(self) -> None:
        """Remove it from the scene."""
        self._root.remove()

    def _draw(self, label: str, points_rig_m: list[Point]) -> None:
        points = np.asarray(points_rig_m, dtype=np.float64)
        newest = points[-1]
        distance_m = float(np.linalg.norm(newest))
        if len(points) > 1:
            self._scene.add_line_segments(
                f"{self._root.name}/line",
                trail_segments(points),
                TRAIL_COLOR,
                thickness=3.0,
                thickness_units="screen",
            )
        self._scene.add_icosphere(
            f"{self._root.name}/marker",
            radius=_MARKER_PER_DISTANCE * distance_m,
            color=TRAIL_COLOR,
            position=newest,
            cast_shadow=False,
            receive_shadow=False,
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
