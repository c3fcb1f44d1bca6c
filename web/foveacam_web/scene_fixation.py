"""One fixation in the 3D scene: marker, label, error bar, cloud and textured surface, under one node."""

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import viser
from numpy.typing import NDArray

from foveacam_pipeline.stereo.values import Cloud
from foveacam_pipeline.verge.values import Basis
from foveacam_web.glb import write_glb
from foveacam_web.scene_values import BASIS_COLORS, SELECTED_COLOR, FixationDrawing

LIVE_POINTS = 50_000
"""A browser without a GPU needs 5-7 us a point and frame; more belongs into the file."""
_MARKER_PER_DISTANCE = 0.004
"""The marker grows with distance, so that it is as easy to hit at 30 m as at 1 m."""
_LABEL_RISE_PER_DISTANCE = 0.021
"""The label stands above the surface: a fovea's field is 2.15 degrees high, half of it is 0.019."""

Clicked: TypeAlias = Callable[[str], Awaitable[None]]


@dataclass(frozen=True, slots=True, kw_only=True)
class FixationParts:
    """Which parts of fixations the operator wants to see."""

    surface: bool = True
    cloud: bool = False
    labels: bool = True


def thin(cloud: Cloud, *, limit: int = LIVE_POINTS) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
    """Return points (n, 3), rig frame, and colours (n, 3) of at most `limit` points spread over the cloud."""
    count = len(cloud)
    if count <= limit:
        return cloud.points_rig_m, cloud.colors
    kept = np.linspace(0, count - 1, limit).astype(np.intp)
    return cloud.points_rig_m[kept], cloud.colors[kept]


class FixationNode:
    """The handles of one fixation; created drawn, gone after `remove`."""

    def __init__(
        self, scene: viser.SceneApi, fixation_id: str, drawing: FixationDrawing, *, shown: FixationParts
    ) -> None:
        self.drawing = drawing
        self._id = fixation_id
        self._scene = scene
        self._color = BASIS_COLORS[drawing.basis]
        self._root = scene.add_frame(f"/fixations/{fixation_id}", show_axes=False)
        self._marker = scene.add_icosphere(
            f"{self._root.name}/marker",
            radius=_MARKER_PER_DISTANCE * drawing.distance_m,
            color=self._color,
            wireframe=drawing.basis is Basis.SURROUNDINGS,
            position=drawing.point_rig_m,
            cast_shadow=False,
            receive_shadow=False,
        )
        self._bar = self._draw_bar()
        self._label = self._draw_label()
        self._surface = self._draw_surface()
        self._cloud = self._draw_cloud()
        self.show(shown)

    @property
    def point_rig_m(self) -> tuple[float, float, float]:
        """Where it is, for the camera of a viewer."""
        return self.drawing.point_rig_m

    def clickable(self, clicked: Clicked) -> None:
        """Call `clicked(id)` on viser's loop when the fixation is clicked; it must only hand over."""

        async def on_click(_event: object) -> None:
            await clicked(self._id)

        self._marker.on_click(on_click)
        if self._surface is not None:
            self._surface.on_click(on_click)

    def show(self, shown: FixationParts) -> None:
        """Show and hide parts."""
        if self._surface is not None:
            self._surface.visible = shown.surface
        if self._cloud is not None:
            self._cloud.visible = shown.cloud
        self._label.visible = shown.labels
        self._bar.visible = shown.labels

    def select(self, *, selected: bool) -> None:
        """Mark or unmark the fixation as the one that the operator works with."""
        self._marker.color = SELECTED_COLOR if selected else self._color
        self._label.font_screen_scale = 1.25 if selected else 1.0

    def remove(self) -> None:
        """Take everything away."""
        self._root.remove()

    def _draw_bar(self) -> viser.LineSegmentsHandle:
        """Draw one standard error to either side along the line of sight."""
        point_m = np.asarray(self.drawing.point_rig_m)
        sight = point_m / max(float(np.linalg.norm(point_m)), 1e-9)
        step_m = self.drawing.distance_sigma_m * sight
        return self._scene.add_line_segments(
            f"{self._root.name}/sigma",
            np.stack((-step_m, step_m))[None].astype(np.float32),
            self._color,
            thickness=3.0,
            thickness_units="screen",
            position=self.drawing.point_rig_m,
        )

    def _draw_label(self) -> viser.LabelHandle:
        x_m, y_m, z_m = self.drawing.point_rig_m
        return self._scene.add_label(
            f"{self._root.name}/label",
            self.drawing.text,
            position=(x_m, y_m - _LABEL_RISE_PER_DISTANCE * self.drawing.distance_m, z_m),
            anchor="bottom-center",
        )

    def _draw_surface(self) -> viser.GlbHandle | None:
        mesh = self.drawing.mesh
        if mesh is None or len(mesh.faces) == 0:
            return None
        centre_m = mesh.vertices_rig_m.mean(axis=0, dtype=np.float64)
        return self._scene.add_glb(
            f"{self._root.name}/surface",
            write_glb(mesh, origin_rig_m=(float(centre_m[0]), float(centre_m[1]), float(centre_m[2]))),
            position=centre_m,
            cast_shadow=False,
            receive_shadow=False,
        )

    def _draw_cloud(self) -> viser.PointCloudHandle | None:
        cloud = self.drawing.cloud
        if cloud is None or len(cloud) == 0:
            return None
        points_rig_m, colors = thin(cloud)
        # viser sends half floats: 8 mm steps at 10 m, a fraction of a millimetre around the centre
        centre_m = points_rig_m.mean(axis=0, dtype=np.float64)
        size_m = np.ptp(points_rig_m[:, :2], axis=0)
        spacing_m = float(np.sqrt(size_m[0] * size_m[1] / len(points_rig_m)))
        return self._scene.add_point_cloud(
            f"{self._root.name}/cloud",
            (points_rig_m - centre_m).astype(np.float32),
            colors,
            point_size=max(spacing_m, 1e-4),
            point_shape="square",
            point_shading="flat",
            position=centre_m,
        )
