"""The scene in time: moves its objects to where they are at a moment, and has them drawn for a camera."""

import threading
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.sim.render.materials import PlainSurface
from foveacam_hardware.sim.render.projection import Projection
from foveacam_hardware.sim.render.renderer import Radiance, Renderer
from foveacam_hardware.sim.render.scene import Scene
from foveacam_hardware.sim.rig_pose import Bearing, in_world, straight_ahead, swept_px
from foveacam_hardware.sim.scenes.build import build_scene
from foveacam_hardware.sim.scenes.format import Object
from foveacam_hardware.sim.scenes.loader import load_scene, scene_path
from foveacam_hardware.sim.scenes.motion import pose

CACHED_FRAMES = 4
"""One for each camera and one to spare; a colour frame with its depth holds 31 MB."""
MARGIN_PX = 200.0

Roi: TypeAlias = tuple[int, int, int, int]
"""x, y, width, height of a part of a picture, px."""


@dataclass(frozen=True, slots=True, eq=False)
class _Mover:
    """An object with a motion, and its box in its own coordinates."""

    number: int
    thing: Object
    corners_m: NDArray[np.float64]


class AnimatedScene:
    """One scene and its renderer; one thread at a time draws.

    Projections are those of the rig's frame; `bearing` says how the rig stands in the scene.
    """

    def __init__(self, name_or_file: str | Path, *, threads: int = 2) -> None:
        path = scene_path(name_or_file)
        self.file = load_scene(path)
        self.name = path.stem
        self.scene = build_scene(self.file, folder=path.parent)
        self._renderer = Renderer(self.scene, threads=threads, cached_frames=CACHED_FRAMES)
        self._prober = Renderer(self.scene, threads=1, cached_frames=2)
        self._movers = [
            _Mover(number, thing, _corners_m(self.scene, number))
            for number, thing in enumerate(self.file.objects)
            if thing.motion is not None
        ]
        self._lock = threading.Lock()
        self.bearing: Bearing = straight_ahead

    @property
    def moves(self) -> bool:
        """Whether anything in the scene moves."""
        return bool(self._movers)

    def radiance(self, projection: Projection, t_s: float, *, channels: int) -> NDArray[np.float32]:
        """Return what a camera receives `t_s` after the beginning, (h, w) or (h, w, 3) float32, 0..1."""
        with self._lock:
            self._set(t_s)
            seen = in_world(projection, self.bearing(t_s))
            return self._renderer.radiance(seen, channels=channels).radiance

    def probe(self, projection: Projection, t_s: float, *, roi: Roi | None = None) -> Radiance:
        """Return depth and identity (truth); the cameras' cached pictures stay as they are."""
        with self._lock:
            self._set(t_s)
            return self._prober.radiance(in_world(projection, self.bearing(t_s)), roi=roi)

    def close(self) -> None:
        """End the renderer's threads."""
        self._renderer.close()
        self._prober.close()

    def motion_px(self, projection: Projection, from_s: float, to_s: float) -> float:
        """Return how far the fastest thing in view moves in the picture between two moments."""
        before, after = self.bearing(from_s), self.bearing(to_s)
        fastest_px = swept_px(projection, before, after)
        seen = in_world(projection, before)
        for mover in self._movers:
            ends = np.stack([pose(mover.thing, from_s), pose(mover.thing, to_s)])
            fastest_px = max(fastest_px, _moved_px(seen, ends, mover.corners_m))
        return fastest_px

    def textured(self, number: int) -> bool:
        """Return whether an object has any texture to match; the background (-1) has none."""
        return number >= 0 and not isinstance(self.scene.material(number), PlainSurface)

    def _set(self, t_s: float) -> None:
        for mover in self._movers:
            self.scene.set_pose(mover.number, pose(mover.thing, t_s))


def _moved_px(projection: Projection, ends: NDArray[np.float64], corners_m: NDArray[np.float64]) -> float:
    """Return how far a box moves in the picture between two poses (2, 4, 4); 0 when it is out of view."""
    corners = ends[:, :3, :3] @ corners_m.T + ends[:, :3, 3:]
    pixels = np.stack([projection.project(end.T) for end in corners])
    if np.isnan(pixels).any():
        return 0.0
    low, high = pixels.min(axis=(0, 1)), pixels.max(axis=(0, 1))
    size = np.array([projection.width, projection.height])
    if (high < -MARGIN_PX).any() or (low > size + MARGIN_PX).any():
        return 0.0
    return float(np.max(np.linalg.norm(pixels[1] - pixels[0], axis=1)))


def _corners_m(scene: Scene, number: int) -> NDArray[np.float64]:
    """Return the eight corners (8, 3) of an object's box in its own coordinates."""
    geometry = scene.snapshot().geometry
    first, end = geometry.first_vertex[number : number + 2]
    low, high = geometry.vertices[first:end].min(axis=0), geometry.vertices[first:end].max(axis=0)
    return np.array([[(low, high)[i >> k & 1][k] for k in range(3)] for i in range(8)])
