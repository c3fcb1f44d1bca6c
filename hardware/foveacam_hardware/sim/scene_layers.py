"""Motion-blurred pictures of a scene with evenly moving objects, from two layers.

Moving and static objects are each drawn once, instead of the whole scene once per few pixels of motion.
"""

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.sim.render.hiding import hiding_depths
from foveacam_hardware.sim.render.projection import Projection
from foveacam_hardware.sim.render.renderer import Renderer
from foveacam_hardware.sim.render.scene import Lighting, Scene
from foveacam_hardware.sim.render.smear import MovingLayer, smear

BACK_FRAMES = 2
"""Cached pictures of what stands still: one of each eye, whose mirrors rest most of the time."""
BLACK = Lighting(horizon=(0.0, 0.0, 0.0), zenith=(0.0, 0.0, 0.0))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ObjectMotion:
    """How the image of an object moves between two times, by the corners of its box.

    `before_px`, `after_px`: (8, 2); `size`: width and height of the image.
    """

    before_px: NDArray[np.float64]
    after_px: NDArray[np.float64]
    size: tuple[int, int]

    @property
    def largest_px(self) -> float:
        """Length of the largest shift of a corner, inside the image or not."""
        return float(np.max(np.linalg.norm(self.after_px - self.before_px, axis=1)))

    def shift(self) -> tuple[NDArray[np.float64], float]:
        """Return the shift (2,) in the middle of the object's visible part, px, and its variation there.

        The shift is fitted as linear in the position; the variation includes the residuals.
        """
        shifts = self.after_px - self.before_px
        places = np.column_stack([self.before_px, np.ones(len(shifts))])
        linear = np.linalg.lstsq(places, shifts, rcond=None)[0]
        low, high = (np.clip(end(self.before_px, axis=0), 0.0, self.size) for end in (np.min, np.max))
        ends = np.array([[low[0], low[1]], [high[0], low[1]], [low[0], high[1]], [high[0], high[1]]])
        at_ends = np.column_stack([ends, np.ones(4)]) @ linear
        scatter_px = np.abs(places @ linear - shifts).max()
        uneven_px = float(np.max(np.ptp(at_ends, axis=0)) + 2.0 * scatter_px)
        return np.asarray(at_ends.mean(axis=0), dtype=np.float64), uneven_px


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ImageMotion:
    """How an image moves between two times."""

    rig_px: float
    """Largest motion caused by the motion of the rig, px."""
    objects: Mapping[int, ObjectMotion]
    """Moving objects in view, by number."""

    @property
    def largest_px(self) -> float:
        """Largest motion of all, px."""
        return max([self.rig_px, *(one.largest_px for one in self.objects.values())])

    def even_shifts(self, within_px: float) -> dict[int, NDArray[np.float64]] | None:
        """Return the shift (2,) px of each object; None where the rig moves, or an object unevenly.

        `within_px`: largest variation over the visible part of an object.
        """
        if self.rig_px > 0.0:
            return None
        found = {number: one.shift() for number, one in self.objects.items()}
        if any(uneven_px > within_px for _, uneven_px in found.values()):
            return None
        return {number: shift_px for number, (shift_px, _) in found.items()}


class SceneLayers:
    """Two renderers, of the objects that move and of the others; not for use by two threads at once."""

    def __init__(self, scene: Scene, moving: Sequence[int], *, threads: int) -> None:
        standing = [number for number in range(len(scene.names)) if number not in moving]
        self._place = {number: place for place, number in enumerate(moving)}
        self._moving = scene.selected(moving, BLACK)
        self._front = Renderer(self._moving, threads=threads, cached_frames=1)
        self._back = Renderer(scene.selected(standing), threads=threads, cached_frames=BACK_FRAMES)
        self._threads, self._pool = threads, ThreadPoolExecutor(threads, "smear")

    def set_pose(self, number: int, pose: NDArray[np.float64]) -> None:
        """Move an object, by its number in the whole scene."""
        self._moving.set_pose(self._place[number], pose)

    def blurred(
        self, projection: Projection, shifts_px: Mapping[int, NDArray[np.float64]], *, channels: int
    ) -> NDArray[np.float32]:
        """Return the mean radiance (h, w) or (h, w, 3) while objects move about their current positions.

        `projection`: without a ray table. `shifts_px`: (2,), that of each moving object in view.
        """
        group, steps = self._steps(shifts_px, projection.C)
        across_px, down_px = np.abs(steps).max(axis=(0, 1)).tolist()
        front = self._front.layer(_widened(projection, across_px, down_px), channels)
        layer = MovingLayer(front.radiance, front.depth_m, front.ids, group, across_px, down_px)
        hiding_m = hiding_depths(layer, steps, projection.width, projection.height)
        back = self._back.behind(projection, hiding_m, channels)
        mean = self._smeared(back.radiance.reshape(*back.ids.shape, channels), back.depth_m, layer, steps)
        return np.asarray(mean[..., 0] if channels == 1 else mean, dtype=np.float32)

    def close(self) -> None:
        """End all threads."""
        self._front.close()
        self._back.close()
        self._pool.shutdown()

    def _smeared(
        self,
        still: NDArray[np.float32],
        depth_m: NDArray[np.float32],
        layer: MovingLayer,
        steps: NDArray[np.int32],
    ) -> NDArray[np.float32]:
        """Return the mean over all steps, a band of rows in each thread."""
        mean = np.empty_like(still)
        ends = np.linspace(0, len(still), self._threads + 1).astype(int).tolist()
        bands = [
            self._pool.submit(smear, still, depth_m, layer, steps, first, end, mean)
            for first, end in pairwise(ends)
        ]
        for band in bands:
            band.result()
        return mean

    def _steps(
        self, shifts_px: Mapping[int, NDArray[np.float64]], centre_m: NDArray[np.float64]
    ) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """Return the group of each object, by equal motion, and each group's shift in each step.

        (n,) group numbers, the nearest first; (k, groups, 2) whole px from the middle of the exposure. An odd
        number of steps of at most a pixel is rounded to an even spread about the middle.
        """
        shifts = np.zeros((len(self._place), 2))
        for number, shift_px in shifts_px.items():
            shifts[self._place[number]] = shift_px
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
