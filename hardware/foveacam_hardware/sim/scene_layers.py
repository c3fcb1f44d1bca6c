"""Pictures of a scene in which objects move evenly during the exposure, from two layers.

What moves and what stands is drawn once each, instead of the whole scene once for every few pixels of motion.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.sim.render.projection import Projection
from foveacam_hardware.sim.render.renderer import Renderer
from foveacam_hardware.sim.render.scene import Lighting, Scene
from foveacam_hardware.sim.render.smear import MovingLayer, smear

BLACK = Lighting(horizon=(0.0, 0.0, 0.0), zenith=(0.0, 0.0, 0.0))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ObjectShift:
    """How the image of an object moves between two times, px of a projection."""

    shift_px: NDArray[np.float64]
    """(2,), in the middle of its part of the image."""
    largest_px: float
    """Length of the largest shift of a corner of its box, inside the image or not."""
    uneven_px: float
    """What the shift differs by within the image."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ImageMotion:
    """How an image moves between two times."""

    rig_px: float
    """Largest motion by the rig's own, px."""
    objects: Mapping[int, ObjectShift]
    """By number, those that are in view and move."""

    @property
    def largest_px(self) -> float:
        """The fastest of all, px."""
        return max([self.rig_px, *(one.largest_px for one in self.objects.values())])

    def even(self, within_px: float) -> bool:
        """Return whether only objects move, and all parts in view of each by the same, to within so much."""
        uneven_px = [one.uneven_px for one in self.objects.values()]
        return self.rig_px == 0.0 and max(uneven_px, default=0.0) <= within_px


def object_shift(
    before_px: NDArray[np.float64], after_px: NDArray[np.float64], *, size: tuple[int, int]
) -> ObjectShift:
    """Return the shift of an object whose box has corners (8, 2) at both times, in an image of a size.

    Within the image the shift is taken as linear in the place; `uneven_px` counts what is not.
    """
    shifts = after_px - before_px
    places = np.column_stack([before_px, np.ones(len(before_px))])
    linear = np.linalg.lstsq(places, shifts, rcond=None)[0]
    low, high = (np.clip(end(before_px, axis=0), 0.0, size) for end in (np.min, np.max))
    ends = np.array([[low[0], low[1]], [high[0], low[1]], [low[0], high[1]], [high[0], high[1]]])
    at_ends = np.column_stack([ends, np.ones(4)]) @ linear
    scatter_px = np.abs(places @ linear - shifts).max()
    return ObjectShift(
        shift_px=np.asarray(at_ends.mean(axis=0), dtype=np.float64),
        largest_px=float(np.max(np.linalg.norm(shifts, axis=1))),
        uneven_px=float(np.max(np.ptp(at_ends, axis=0)) + 2.0 * scatter_px),
    )


class SceneLayers:
    """Two renderers, of the objects that move and of the others; not for use by two threads at once."""

    def __init__(self, scene: Scene, moving: Sequence[int], *, threads: int) -> None:
        standing = [number for number in range(len(scene.names)) if number not in moving]
        self._place = {number: place for place, number in enumerate(moving)}
        self._moving = scene.selected(moving, BLACK)
        self._front = Renderer(self._moving, threads=threads, cached_frames=1)
        self._back = Renderer(scene.selected(standing), threads=threads, cached_frames=1)

    def set_pose(self, number: int, pose: NDArray[np.float64]) -> None:
        """Move an object, by its number in the whole scene."""
        self._moving.set_pose(self._place[number], pose)

    def blurred(
        self, projection: Projection, objects: Mapping[int, ObjectShift], *, channels: int
    ) -> NDArray[np.float32]:
        """Return the mean radiance (h, w) or (h, w, 3) while objects move about where they are.

        `projection`: without a ray table. `objects`: how each moving object in view moves.
        """
        group, steps = self._steps(objects, projection.C)
        across_px, down_px = np.abs(steps).max(axis=(0, 1)).tolist()
        back = self._back.radiance(projection, channels=channels)
        front = self._front.layer(_widened(projection, across_px, down_px), channels)
        layer = MovingLayer(front.radiance, front.depth_m, front.ids, group, across_px, down_px)
        mean = smear(back.radiance.reshape(*back.ids.shape, channels), back.depth_m, layer, steps)
        return np.asarray(mean[..., 0] if channels == 1 else mean, dtype=np.float32)

    def close(self) -> None:
        """End the renderers' threads."""
        self._front.close()
        self._back.close()

    def _steps(
        self, objects: Mapping[int, ObjectShift], centre_m: NDArray[np.float64]
    ) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """Return which objects move alike, and where each group of them is in each step.

        (n,) the group of each object, the nearest first; (k, groups, 2) whole px from the middle of the
        exposure. An odd number of steps of at most a pixel is rounded to an even spread about the middle.
        """
        shifts = np.zeros((len(self._place), 2))
        for number, moved in objects.items():
            shifts[self._place[number]] = moved.shift_px
        poses = self._moving.snapshot().poses
        order = np.argsort(np.linalg.norm(poses[:, :3, 3] - centre_m, axis=1))
        _, first, found = np.unique(shifts[order], axis=0, return_index=True, return_inverse=True)
        rank = np.argsort(np.argsort(first))
        group = np.empty(len(order), np.int32)
        group[order] = rank[found.ravel()]
        whole = shifts[order][np.sort(first)]
        count = 2 * int(np.ceil(np.abs(whole).max() / 2.0)) + 1
        passed = (np.arange(count) + 0.5) / count - 0.5
        steps = np.rint(passed[:, None, None] * whole)
        return group, np.ascontiguousarray(steps, dtype=np.int32)


def _widened(projection: Projection, across_px: int, down_px: int) -> Projection:
    """Return a projection to a picture with more pixels on each side."""
    moved = np.array([[1.0, 0.0, across_px], [0.0, 1.0, down_px], [0.0, 0.0, 1.0]])
    width, height = projection.width + 2 * across_px, projection.height + 2 * down_px
    return replace(projection, M=moved @ projection.M, width=width, height=height)
