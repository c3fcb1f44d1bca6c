"""Compiles the kernels of the renderer, each alone and without rendering a frame.

A kernel is compiled for the types of its arguments, which do not depend on the scene.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import typeof

from foveacam_hardware.sim.render.batch import new_batch
from foveacam_hardware.sim.render.binning import TileBins, sort_into_tiles, tile_shifts
from foveacam_hardware.sim.render.frame_inputs import kernel_view, object_table, tile_inputs
from foveacam_hardware.sim.render.hiding import hiding_depths
from foveacam_hardware.sim.render.items import new_items
from foveacam_hardware.sim.render.materials import NoiseSurface
from foveacam_hardware.sim.render.noise_material import noise_levels
from foveacam_hardware.sim.render.projection import Projection
from foveacam_hardware.sim.render.scene import Scene, SceneSnapshot
from foveacam_hardware.sim.render.sensor import SensorExposure, expose, expose_rows
from foveacam_hardware.sim.render.setup import KernelView, ObjectTable, empty_corners, empty_prims, set_up
from foveacam_hardware.sim.render.shade import CUT_PX
from foveacam_hardware.sim.render.shapes import Quad, place
from foveacam_hardware.sim.render.smear import MovingLayer, smear
from foveacam_hardware.sim.render.tiles import (
    TileInputs,
    TileOutputs,
    find_marks,
    find_runs,
    gather_marks,
    render_tiles,
    shade_runs,
)
from foveacam_hardware.sim.render.visibility import new_tile

Progress = Callable[[int, int, str], None]
"""Called with the steps done, their total, and the name of the next step."""
WIDTH, HEIGHT = 64, 32
"""Size of the frame that gives the types: one tile, px."""


@dataclass(frozen=True, slots=True, kw_only=True)
class KernelStep:
    """A kernel or separately cached part, with a call that compiles it and computes next to nothing."""

    name: str
    kernel: Any  # numba ships no types
    compile: Callable[[], object]


def kernel_steps() -> tuple[KernelStep, ...]:
    """Return all kernels that are called from Python."""
    return (
        KernelStep(name="tiles", kernel=render_tiles, compile=_compile_tiles),
        KernelStep(name="set-up", kernel=set_up, compile=_compile_set_up),
        KernelStep(name="faces of tiles", kernel=sort_into_tiles, compile=_compile_sort_into_tiles),
        KernelStep(name="lens", kernel=tile_shifts, compile=_compile_tile_shifts),
        KernelStep(name="sensor", kernel=expose_rows, compile=_compile_expose),
        KernelStep(name="motion", kernel=smear, compile=_compile_smear),
        KernelStep(name="hiding", kernel=hiding_depths, compile=_compile_hiding),
    )


def part_steps() -> tuple[KernelStep, ...]:
    """Return the parts of the kernel `tiles` that other processes may compile before it."""
    return (
        KernelStep(name="shading", kernel=shade_runs, compile=_compile_shading),
        KernelStep(name="visibility", kernel=find_runs, compile=_compile_visibility),
        KernelStep(name="edges", kernel=find_marks, compile=_compile_edges),
        KernelStep(name="samples", kernel=gather_marks, compile=_compile_samples),
    )


def _report_nothing(done: int, total: int, name: str) -> None:
    """Report nothing."""


def warm_up(progress: Progress = _report_nothing) -> None:
    """Compile every kernel, or load it from the cache on disk, before the first frame is requested."""
    steps: list[tuple[str, Callable[[], object]]] = [("noise tile", noise_levels)]
    steps += [(step.name, step.compile) for step in kernel_steps()]
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

    def objects(self, view: KernelView) -> ObjectTable:
        return object_table(self.snapshot, self.projection, view)

    def stage(self) -> TileInputs:
        view = self.view()
        bins = TileBins(np.zeros(2, np.int64), np.empty(0, np.int32))
        return tile_inputs(
            self.snapshot, view, self.objects(view), empty_prims(1), bins, channels=1, cut_px=CUT_PX
        )


def _small_frame() -> _SmallFrame:
    scene = Scene()
    scene.add(Quad(width_m=1.0, height_m=1.0), NoiseSurface(), place((0.0, 0.0, 2.0)), "panel")
    M = np.array([[100.0, 0.0, 31.5], [0.0, 100.0, 15.5], [0.0, 0.0, 1.0]])
    return _SmallFrame(scene.snapshot(), Projection(M=M, C=np.zeros(3), width=WIDTH, height=HEIGHT))


def _compile_for(kernel: Any, *arguments: object) -> None:  # noqa: ANN401 (numba ships no types)
    """Compile a kernel for the types of these arguments, or load it from the cache."""
    kernel.compile(tuple(map(typeof, arguments)))


def _compile_set_up() -> None:
    frame = _small_frame()
    geometry, view = frame.snapshot.geometry, frame.view()
    corners, prims = empty_corners(len(geometry.vertices)), empty_prims(len(geometry.faces))
    _compile_for(set_up, geometry, frame.objects(view), frame.snapshot.ambient, view, corners, prims)


def _compile_sort_into_tiles() -> None:
    _compile_for(sort_into_tiles, empty_prims(1), 0, _small_frame().view(), np.zeros((1, 1), bool))


def _compile_tile_shifts() -> None:
    _compile_for(tile_shifts, _small_frame().view().shift, WIDTH, HEIGHT)


def _compile_tiles() -> None:
    size = (HEIGHT, WIDTH)
    target = TileOutputs(
        np.zeros((*size, 1), np.float32), np.zeros(size, np.float32), np.zeros(size, np.int32)
    )
    _compile_for(render_tiles, np.zeros(1, np.int64), _small_frame().stage(), target)


def _compile_smear() -> None:
    layer, steps, mean = _small_layer(), np.zeros((1, 1, 2), np.int32), np.zeros((1, 1, 1), np.float32)
    _compile_for(smear, layer.radiance, layer.depth, layer, steps, 0, 1, mean)


def _compile_hiding() -> None:
    _compile_for(hiding_depths, _small_layer(), np.zeros((1, 1, 2), np.int32), WIDTH, HEIGHT)


def _small_layer() -> MovingLayer:
    """Return a layer of one pixel, of the types of every layer."""
    picture, depth = np.zeros((1, 1, 1), np.float32), np.zeros((1, 1), np.float32)
    ids = np.zeros((1, 1), np.int32)
    for drawn in (picture, depth, ids):
        drawn.flags.writeable = False
    return MovingLayer(picture, depth, ids, np.zeros(1, np.int32), 0, 0)


def _compile_expose() -> None:
    for bits in (8, 12):
        expose(np.zeros((4, 64), np.float32), SensorExposure(bits=bits), (0, 0, 0))


def _compile_shading() -> None:
    colour = np.zeros((1, 1), np.float32)
    _compile_for(shade_runs, new_batch.py_func(), 0, new_items.py_func(), _small_frame().stage(), colour)


def _compile_visibility() -> None:
    tile, batch = new_tile.py_func(), new_batch.py_func()
    _compile_for(find_runs, tile, 0, 0, 0, WIDTH, HEIGHT, _small_frame().stage(), batch)


def _compile_edges() -> None:
    _compile_for(find_marks, new_tile.py_func(), 0, 0, 0, WIDTH, HEIGHT, _small_frame().stage())


def _compile_samples() -> None:
    weight, start = np.zeros(1, np.float32), np.zeros(1, np.int32)
    tile, batch = new_tile.py_func(), new_batch.py_func()
    _compile_for(gather_marks, tile, 0, 0, _small_frame().stage(), batch, weight, start)
