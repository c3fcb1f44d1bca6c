"""Draws the rig in the 3D scene: its frame, three frusta, the gaze rays, and a floor grid with distances."""

import math

import numpy as np
import viser
from numpy.typing import NDArray
from viser import transforms

from foveacam_web.scene_values import (
    DEFAULT_RAY_M,
    LEFT_COLOR,
    RIGHT_COLOR,
    WIDE_COLOR,
    EyeGaze,
    Rgb,
    RigShape,
)

_FLOOR_Y_M = 0.45
"""Height of the grid, below the rig; +y points down."""
_FLOOR_DEPTH_M = 40.0
_FLOOR_WIDTH_M = 20.0
_MARKS_M = (1, 2, 3, 5, 10, 20, 40)
"""So far apart that their labels do not overlap, seen from the rig."""
_MARKS_X_M = -0.8
_WIDE_DEPTH_M = 0.35
"""Depth of the wide camera's frustum; those of the foveae reach to the distance looked at."""
_GRID_COLOR: Rgb = (146, 151, 160)
"""Between the grounds of the light and the dark page, so that the grid is quiet on both."""
_FADE_M = 12.0
_LINE_PX = 1.0
_STRAIGHT = EyeGaze(ax_rad=0.0, ay_rad=0.0)


def gaze_direction(gaze: EyeGaze) -> NDArray[np.float64]:
    """Return the unit vector of a gaze, (3,) float64, rig frame."""
    direction = np.array([math.tan(gaze.ax_rad), math.tan(gaze.ay_rad), 1.0])
    return direction / float(np.linalg.norm(direction))


def rig_from_gaze(gaze: EyeGaze) -> NDArray[np.float64]:
    """Return the rotation, (3, 3) float64, with the gaze as z axis and a level x axis."""
    z = gaze_direction(gaze)
    x = np.cross((0.0, 1.0, 0.0), z)
    x /= np.linalg.norm(x)
    return np.stack((x, np.cross(z, x), z), axis=1)


def frustum_scale(fov_rad: tuple[float, float], *, depth_m: float) -> float:
    """Return viser's scale of a frustum of depth `depth_m`; viser's scale sets the frustum's volume."""
    horizontal_rad, vertical_rad = fov_rad
    base = math.tan(horizontal_rad / 2.0) * math.tan(vertical_rad / 2.0)
    return depth_m * math.cbrt(base / 3.0)


class RigDrawing:
    """The parts of the scene that do not depend on fixations; the foveae turn with the gaze."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        self._shape: RigShape | None = None
        self._gaze: dict[str, EyeGaze | None] = {"left": _STRAIGHT, "right": _STRAIGHT}
        self._ray_m = DEFAULT_RAY_M
        self._eyes: dict[str, viser.CameraFrustumHandle] = {}
        self._rays: dict[str, viser.LineSegmentsHandle] = {}
        self._rays_visible = True
        self._floor: list[viser.GridHandle | viser.LabelHandle] = []

    @property
    def shape(self) -> RigShape | None:
        """The rig that is drawn; None before the first."""
        return self._shape

    def draw_floor(self) -> None:
        """Draw the grid, one line per metre, labelled with distances from the rig."""
        grid = self._scene.add_grid(
            "/floor",
            width=_FLOOR_WIDTH_M,
            height=_FLOOR_DEPTH_M,
            plane="xz",
            position=(0.0, _FLOOR_Y_M, _FLOOR_DEPTH_M / 2.0),
            cell_size=1.0,
            section_size=5.0,
            cell_color=_GRID_COLOR,
            cell_thickness=0.5,
            section_color=_GRID_COLOR,
            fade_distance=_FADE_M,
            fade_strength=1.5,
            shadow_opacity=0.0,
        )
        self._floor.append(grid)
        for z_m in _MARKS_M:
            mark = self._scene.add_label(
                f"/floor_marks/{z_m}",
                f"{z_m} m",
                position=(_MARKS_X_M, _FLOOR_Y_M, float(z_m)),
                font_size_mode="scene",
                font_scene_height=0.015 + 0.007 * z_m,
                anchor="center-right",
            )
            self._floor.append(mark)

    def show_floor(self, *, visible: bool) -> None:
        """Set whether the floor is visible: it gives a scene its depth until the picture of one does."""
        for part in self._floor:
            part.visible = visible

    def draw(self, shape: RigShape) -> None:
        """Draw the rig frame and the three cameras in place of earlier ones."""
        self._shape = shape
        self._scene.add_frame("/rig", axes_length=0.08, axes_radius=0.002)
        self._scene.add_label("/rig/name", "wide", position=(0.0, -0.05, 0.0), font_screen_scale=0.8)
        self._frustum("wide", fov_rad=shape.wide_fov_rad, x_m=0.0, color=WIDE_COLOR, depth_m=_WIDE_DEPTH_M)
        for eye, sign, color in (("left", -0.5, LEFT_COLOR), ("right", 0.5, RIGHT_COLOR)):
            x_m = sign * shape.baseline_m
            self._eyes[eye] = self._frustum(
                eye, fov_rad=shape.fovea_fov_rad, x_m=x_m, color=color, depth_m=self._ray_m
            )
            self._rays[eye] = self._scene.add_line_segments(
                f"/gaze/{eye}",
                np.zeros((1, 2, 3), dtype=np.float32),
                color,
                thickness=_LINE_PX,
                thickness_units="screen",
                position=(x_m, 0.0, 0.0),
                visible=self._rays_visible,
            )
        self._turn(shape)

    def look(self, *, left: EyeGaze | None, right: EyeGaze | None, distance_m: float | None) -> None:
        """Turn the foveae and set their rays' length; None hides a fovea. Sends nothing when unchanged."""
        gaze = {"left": left, "right": right}
        ray_m = DEFAULT_RAY_M if distance_m is None else distance_m
        if (gaze, ray_m) == (self._gaze, self._ray_m):
            return
        self._gaze, self._ray_m = gaze, ray_m
        if self._shape is not None:
            self._turn(self._shape)

    def show_rays(self, *, visible: bool) -> None:
        """Set whether the gaze rays are visible."""
        self._rays_visible = visible
        for eye, ray in self._rays.items():
            ray.visible = visible and self._gaze[eye] is not None

    def _turn(self, shape: RigShape) -> None:
        for eye, gaze in self._gaze.items():
            self._eyes[eye].visible = gaze is not None
            self._rays[eye].visible = gaze is not None and self._rays_visible
            if gaze is None:
                continue
            self._eyes[eye].scale = frustum_scale(shape.fovea_fov_rad, depth_m=self._ray_m)
            self._eyes[eye].wxyz = transforms.SO3.from_matrix(rig_from_gaze(gaze)).wxyz
            ends_m = np.stack((np.zeros(3), self._ray_m * gaze_direction(gaze)))
            self._rays[eye].points = ends_m[None].astype(np.float32)

    def _frustum(
        self, eye: str, *, fov_rad: tuple[float, float], x_m: float, color: Rgb, depth_m: float
    ) -> viser.CameraFrustumHandle:
        horizontal_rad, vertical_rad = fov_rad
        return self._scene.add_camera_frustum(
            f"/cameras/{eye}",
            fov=vertical_rad,
            aspect=math.tan(horizontal_rad / 2.0) / math.tan(vertical_rad / 2.0),
            scale=frustum_scale(fov_rad, depth_m=depth_m),
            color=color,
            thickness=_LINE_PX,
            thickness_units="screen",
            position=(x_m, 0.0, 0.0),
            cast_shadow=False,
            receive_shadow=False,
        )
