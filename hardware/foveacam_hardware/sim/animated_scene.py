"""A scene whose objects move: sets their poses for a time, and renders the scene for a camera.

The file format is in `scenes`, the renderer in `render`, the pose of the rig in `rig_pose`.
"""

import threading
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.sim.render.materials import PlainSurface
from foveacam_hardware.sim.render.projection import Projection
from foveacam_hardware.sim.render.renderer import Radiance, Renderer
from foveacam_hardware.sim.render.scene import Scene
from foveacam_hardware.sim.rig_pose import RigPoseAtTime, image_motion_px, project_in_world, unmoved_rig
from foveacam_hardware.sim.scene_layers import ImageMotion, ObjectMotion, SceneLayers
from foveacam_hardware.sim.scenes.build import build_scene
from foveacam_hardware.sim.scenes.format import SceneFile
from foveacam_hardware.sim.scenes.loader import SCENES_FOLDER, load_scene, scene_path
from foveacam_hardware.sim.scenes.motion import PoseAtTime, pose_function

CACHED_FRAMES = 4
"""Frames in the cache: one per camera and a spare one; a colour frame with its depth takes 31 MB."""

Roi: TypeAlias = tuple[int, int, int, int]
"""x, y, width, height of a part of an image, px."""


@dataclass(frozen=True, slots=True, eq=False)
class _MovingObject:
    """A moving object, and the corners (8, 3) of its bounding box in object coordinates."""

    number: int
    pose: PoseAtTime
    corners_m: NDArray[np.float64]


class AnimatedScene:
    """One scene and its renderer; one thread renders at a time.

    Projections are in the rig frame; `rig_pose` returns the pose of the rig in the scene.
    """

    def __init__(self, scene: str | Path | SceneFile, *, threads: int = 2) -> None:
        """Build from a shipped scene, a scene file, or a scene that was already read or generated."""
        if isinstance(scene, SceneFile):
            self.file, self.name, folder = scene, scene.title, SCENES_FOLDER
        else:
            path = scene_path(scene)
            self.file, self.name, folder = load_scene(path), path.stem, path.parent
        self.scene = build_scene(self.file, folder=folder)
        self._renderer = Renderer(self.scene, threads=threads, cached_frames=CACHED_FRAMES)
        self._probe_renderer = Renderer(self.scene, threads=1, cached_frames=2)
        self._moving = [
            _MovingObject(number, pose_function(entry), _corners_m(self.scene, number))
            for number, entry in enumerate(self.file.objects)
            if entry.motion is not None
        ]
        numbers = [moving.number for moving in self._moving]
        self._layers = SceneLayers(self.scene, numbers, threads=threads)
        self._lock = threading.Lock()
        self.rig_pose: RigPoseAtTime = unmoved_rig

    def radiance(self, projection: Projection, t_s: float, *, channels: int) -> NDArray[np.float32]:
        """Return the radiance (h, w) or (h, w, 3) float32, 0..1, in a camera at scene time `t_s`."""
        with self._lock:
            self._set_poses(t_s)
            in_world = project_in_world(projection, self.rig_pose(t_s))
            return self._renderer.radiance(in_world, channels=channels).radiance

    def blurred(
        self,
        projection: Projection,
        t_s: float,
        shifts_px: Mapping[int, NDArray[np.float64]],
        *,
        channels: int,
    ) -> NDArray[np.float32]:
        """Return the mean radiance over an exposure centred at `t_s`, in the form of `radiance`.

        `projection`: without a ray table. `shifts_px`: (2,), of each object in view during the exposure.
        """
        with self._lock:
            for moving in self._moving:
                self._layers.set_pose(moving.number, moving.pose(t_s))
            in_world = project_in_world(projection, self.rig_pose(t_s))
            return self._layers.blurred(in_world, shifts_px, channels=channels)

    def probe(self, projection: Projection, t_s: float, *, roi: Roi | None = None) -> Radiance:
        """Return radiance, depth and object numbers (truth) without touching the cameras' cached frames."""
        with self._lock:
            self._set_poses(t_s)
            return self._probe_renderer.radiance(project_in_world(projection, self.rig_pose(t_s)), roi=roi)

    def close(self) -> None:
        """End the renderer's threads."""
        self._renderer.close()
        self._probe_renderer.close()
        self._layers.close()

    def motion(self, projection: Projection, from_s: float, to_s: float) -> ImageMotion:
        """Return how the image moves between two times."""
        before, after = self.rig_pose(from_s), self.rig_pose(to_s)
        in_world = project_in_world(projection, before)
        objects = {}
        for moving in self._moving:
            ends = np.stack([moving.pose(from_s), moving.pose(to_s)])
            if (moved := _motion(in_world, ends, moving.corners_m)) is not None:
                objects[moving.number] = moved
        return ImageMotion(rig_px=image_motion_px(projection, before, after), objects=objects)

    def textured(self, number: int) -> bool:
        """Return whether an object has texture to match; the background (-1) has none."""
        return number >= 0 and not isinstance(self.scene.material(number), PlainSurface)

    def _set_poses(self, t_s: float) -> None:
        for moving in self._moving:
            self.scene.set_pose(moving.number, moving.pose(t_s))


def _motion(
    projection: Projection, ends: NDArray[np.float64], corners_m: NDArray[np.float64]
) -> ObjectMotion | None:
    """Return how a box (8, 3) moves in the image between two poses (2, 4, 4); None when it is out of view."""
    corners = ends[:, :3, :3] @ corners_m.T + ends[:, :3, 3:]
    before, after = (projection.project(end.T) for end in corners)
    both = np.concatenate([before, after])
    if np.isnan(both).any():
        return None
    size = (projection.width, projection.height)
    if (both.max(axis=0) < 0.0).any() or (both.min(axis=0) > size).any():
        return None
    return ObjectMotion(before_px=before, after_px=after, size=size)


def _corners_m(scene: Scene, number: int) -> NDArray[np.float64]:
    """Return the corners (8, 3) of an object's bounding box in object coordinates."""
    geometry = scene.snapshot().geometry
    first, end = geometry.first_vertex[number : number + 2]
    low, high = geometry.vertices[first:end].min(axis=0), geometry.vertices[first:end].max(axis=0)
    return np.array([[(low, high)[i >> k & 1][k] for k in range(3)] for i in range(8)])
