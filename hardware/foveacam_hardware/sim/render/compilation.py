"""Compiles the kernels of the renderer, each alone and without rendering a frame.

A kernel is compiled for the types of its arguments, which do not depend on the scene.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from foveacam_hardware.sim.render.binning import TileBins, sort_into_tiles, tile_shifts
from foveacam_hardware.sim.render.frame_inputs import kernel_view, object_table, tile_inputs
from foveacam_hardware.sim.render.materials import NoiseSurface
from foveacam_hardware.sim.render.noise import noise_levels
from foveacam_hardware.sim.render.projection import Projection
from foveacam_hardware.sim.render.scene import Scene, SceneSnapshot
from foveacam_hardware.sim.render.sensor import SensorExposure, expose, expose_rows
from foveacam_hardware.sim.render.setup import KernelView, empty_corners, empty_prims, set_up
from foveacam_hardware.sim.render.shapes import Quad, place
from foveacam_hardware.sim.render.tiles import TileOutputs, render_tiles

Progress = Callable[[int, int, str], None]
"""Called with the steps done, their total, and the name of the next step."""
WIDTH, HEIGHT = 64, 32
"""Size of the frame that gives the types: one tile, px."""


@dataclass(frozen=True, slots=True, kw_only=True)
class KernelStep:
    """A kernel that is called from Python, and a call of it that compiles it and computes next to nothing."""

    name: str
    kernel: Any  # numba ships no types
    call: Callable[[], object]


def kernel_steps() -> tuple[KernelStep, ...]:
    """Return all kernels of the renderer, the one that takes longest to compile first."""
    return (
        KernelStep(name="tiles", kernel=render_tiles, call=_call_render_tiles),
        KernelStep(name="set-up", kernel=set_up, call=_call_set_up),
        KernelStep(name="faces of tiles", kernel=sort_into_tiles, call=_call_sort_into_tiles),
        KernelStep(name="lens", kernel=tile_shifts, call=_call_tile_shifts),
        KernelStep(name="sensor", kernel=expose_rows, call=_call_expose),
    )


def _report_nothing(done: int, total: int, name: str) -> None:
    """Report nothing."""


def warm_up(progress: Progress = _report_nothing) -> None:
    """Compile every kernel, or load it from the cache on disk, before the first frame is requested."""
    steps = (("noise tile", noise_levels), *((step.name, step.call) for step in kernel_steps()))
    for done, (name, call) in enumerate(steps):
        progress(done, len(steps), name)
        call()
    progress(len(steps), len(steps), "ready")


@dataclass(frozen=True, slots=True)
class _SmallFrame:
    """A frame of one tile that shows nothing, of the types of every frame."""

    snapshot: SceneSnapshot
    projection: Projection

    def view(self) -> KernelView:
        shift = np.zeros((1, 1, 2), np.float32)
        shift.flags.writeable = False
        return kernel_view(self.projection, shift, np.zeros((2, 4)))


def _small_frame() -> _SmallFrame:
    scene = Scene()
    scene.add(Quad(width_m=1.0, height_m=1.0), NoiseSurface(), place((0.0, 0.0, 2.0)), "panel")
    M = np.array([[100.0, 0.0, 31.5], [0.0, 100.0, 15.5], [0.0, 0.0, 1.0]])
    return _SmallFrame(scene.snapshot(), Projection(M=M, C=np.zeros(3), width=WIDTH, height=HEIGHT))


def _call_set_up() -> None:
    frame = _small_frame()
    geometry, view = frame.snapshot.geometry, frame.view()
    objects = object_table(frame.snapshot, frame.projection, view)
    corners, prims = empty_corners(len(geometry.vertices)), empty_prims(len(geometry.faces))
    set_up(geometry, objects, frame.snapshot.ambient, view, corners, prims)


def _call_sort_into_tiles() -> None:
    sort_into_tiles(empty_prims(1), 0, _small_frame().view(), np.zeros((1, 1), bool))


def _call_tile_shifts() -> None:
    tile_shifts(_small_frame().view().shift, WIDTH, HEIGHT)


def _call_render_tiles() -> None:
    frame = _small_frame()
    view = frame.view()
    objects = object_table(frame.snapshot, frame.projection, view)
    bins = TileBins(np.zeros(2, np.int64), np.empty(0, np.int32))
    stage = tile_inputs(frame.snapshot, view, objects, empty_prims(1), bins, channels=1)
    size = (HEIGHT, WIDTH)
    target = TileOutputs(
        np.zeros((*size, 1), np.float32), np.zeros(size, np.float32), np.zeros(size, np.int32)
    )
    render_tiles(np.zeros(0, np.int64), stage, target)


def _call_expose() -> None:
    for bits in (8, 12):
        expose(np.zeros((4, 64), np.float32), SensorExposure(bits=bits), (0, 0, 0))
