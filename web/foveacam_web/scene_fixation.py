"""Draws one fixation in the 3D scene: `FixationNode` with a distance, `LimitsNode` with limits of it."""

from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
import viser
from numpy.typing import NDArray

from foveacam_pipeline.stereo.values import Cloud
from foveacam_pipeline.verge.values import Basis
from foveacam_web.glb import write_glb
from foveacam_web.scene_values import (
    BASIS_COLORS,
    LIMITS_COLOR,
    SELECTED_COLOR,
    FixationDrawing,
    LimitsDrawing,
    Point,
)
from foveacam_web.scene_viewpoints import Pose, pose_before

LIVE_POINTS = 50_000
"""Most points of a cloud sent to viewers: a browser without a GPU needs 5-7 us per point and frame."""
_MARKER_PER_DISTANCE = 0.0025
"""Marker radius as a share of the distance, so that it is as easy to click at 30 m as at 1 m."""
_MARKER_ON_SHAPE = 0.3
"""Factor on it where a shape, which can be clicked as well, is not to be covered."""
_LABEL_RISE_PER_DISTANCE = 0.021
"""Height of the label above the target as a share of the distance: half a fovea's 2.15 deg field is 0.019."""
_SELECTED_LABEL_SCALE = 1.25

Clicked: TypeAlias = Callable[[str], Awaitable[None]]


@dataclass(frozen=True, slots=True, kw_only=True)
class FixationParts:
    """The parts of fixations that are shown."""

    surface: bool = True
    cloud: bool = False
    labels: bool = True


def thin(cloud: Cloud, *, limit: int = LIVE_POINTS) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
    """Return points, (n, 3) float32, m, rig frame, and colours, (n, 3) uint8; n is `limit` at most."""
    count = len(cloud)
    if count <= limit:
        return cloud.points_rig_m, cloud.colors
    kept = np.linspace(0, count - 1, limit).astype(np.intp)
    return cloud.points_rig_m[kept], cloud.colors[kept]


def _on_click(
    handles: Sequence[viser.IcosphereHandle | viser.GlbHandle], fixation_id: str, clicked: Clicked
) -> None:
    """Call `clicked(fixation_id)` on viser's loop when one of the handles is clicked."""

    async def on_click(_event: object) -> None:
        await clicked(fixation_id)

    for handle in handles:
        handle.on_click(on_click)


class FixationNode:
    """One fixation with a distance: marker, error bar, label, surface and cloud, drawn at construction."""

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
            radius=_MARKER_PER_DISTANCE * drawing.distance_m * (_MARKER_ON_SHAPE if self.has_shape else 1.0),
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
        self._shown: FixationParts | None = None
        self.show(shown)

    @property
    def point_rig_m(self) -> Point:
        """The target, m, rig frame."""
        return self.drawing.point_rig_m

    @property
    def label_rig_m(self) -> Point:
        """The place of the label above the target, m, rig frame."""
        x_m, y_m, z_m = self.drawing.point_rig_m
        return x_m, y_m - _LABEL_RISE_PER_DISTANCE * self.drawing.distance_m, z_m

    @property
    def has_shape(self) -> bool:
        """Whether there is more to see than a marker."""
        return self.drawing.cloud is not None or self.drawing.mesh is not None

    @property
    def pose(self) -> Pose:
        """The pose that frames it."""
        mesh, cloud = self.drawing.mesh, self.drawing.cloud
        if mesh is not None and len(mesh.faces):
            return pose_before(self.point_rig_m, mesh.vertices_rig_m)
        return pose_before(self.point_rig_m, None if cloud is None else cloud.points_rig_m)

    def clickable(self, clicked: Clicked) -> None:
        """Call `clicked(id)` on viser's loop when marker or surface is clicked; it must not block."""
        handles = (self._marker, self._surface)
        _on_click([handle for handle in handles if handle is not None], self._id, clicked)

    def show(self, shown: FixationParts) -> None:
        """Set which parts are visible; no effect where they are."""
        if shown == self._shown:
            return
        self._shown = shown
        if self._surface is not None:
            self._surface.visible = shown.surface
        if self._cloud is not None:
            self._cloud.visible = shown.cloud
        self._label.visible = shown.labels
        self._bar.visible = shown.labels

    def relabel(self, label: str) -> None:
        """Give it another name."""
        self.drawing = replace(self.drawing, label=label)
        self._label.text = self.drawing.text

    def select(self, *, selected: bool) -> None:
        """Set whether the fixation is highlighted as the selected one."""
        self._marker.color = SELECTED_COLOR if selected else self._color
        self._label.font_screen_scale = _SELECTED_LABEL_SCALE if selected else 1.0

    def remove(self) -> None:
        """Remove its parts from the scene."""
        self._root.remove()

    def _draw_bar(self) -> viser.LineSegmentsHandle:
        """Draw one standard error to either side of the target along the line of sight."""
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
        return self._scene.add_label(
            f"{self._root.name}/label", self.drawing.text, position=self.label_rig_m, anchor="bottom-center"
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
        # viser sends float16: steps of 8 mm at 10 m, below 1 mm around the centre
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


class LimitsNode:
    """One fixation with only limits of its distance: the line of sight between them."""

    def __init__(
        self, scene: viser.SceneApi, fixation_id: str, drawing: LimitsDrawing, *, shown: FixationParts
    ) -> None:
        self.drawing = drawing
        self._id = fixation_id
        self._root = scene.add_frame(f"/fixations/{fixation_id}", show_axes=False)
        ends_m = drawing.ends_rig_m()
        self._nearest_m = ends_m[0]
        scene.add_line_segments(
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
        self._shown: FixationParts | None = None
        self.show(shown)

    @property
    def point_rig_m(self) -> Point:
        """The nearest end of the line, m, rig frame."""
        x_m, y_m, z_m = self._nearest_m.tolist()
        return x_m, y_m, z_m

    @property
    def label_rig_m(self) -> Point:
        """The place of the label, m, rig frame."""
        return self.point_rig_m

    @property
    def pose(self) -> Pose:
        """The pose that frames its nearest end."""
        return pose_before(self.point_rig_m)

    def clickable(self, clicked: Clicked) -> None:
        """Call `clicked(id)` on viser's loop when an end of the line is clicked; it must not block."""
        _on_click(self._markers, self._id, clicked)

    def show(self, shown: FixationParts) -> None:
        """Set whether the label is visible; the line always is. No effect where it is."""
        if shown == self._shown:
            return
        self._shown = shown
        self._label.visible = shown.labels

    def relabel(self, label: str) -> None:
        """Give it another name."""
        self.drawing = replace(self.drawing, label=label)
        self._label.text = self.drawing.text

    def select(self, *, selected: bool) -> None:
        """Set whether the fixation is highlighted as the selected one."""
        for marker in self._markers:
            marker.color = SELECTED_COLOR if selected else LIMITS_COLOR
        self._label.font_screen_scale = _SELECTED_LABEL_SCALE if selected else 1.0

    def remove(self) -> None:
        """Remove its parts from the scene."""
        self._root.remove()
