"""Compile every kernel before the first frame is asked for: once per machine, then read from the cache."""

from collections.abc import Callable

import numpy as np

from foveacam_hardware.sim.render.materials import NoiseSurface
from foveacam_hardware.sim.render.noise import noise_levels
from foveacam_hardware.sim.render.projection import Projection
from foveacam_hardware.sim.render.renderer import Renderer
from foveacam_hardware.sim.render.scene import Scene
from foveacam_hardware.sim.render.sensor import SensorExposure, expose
from foveacam_hardware.sim.render.shapes import Quad, place

Progress = Callable[[int, int, str], None]
"""Called with steps done, steps in all, and what comes next."""


def _silent(done: int, total: int, name: str) -> None:
    """Report nothing."""


def _render() -> None:
    scene = Scene()
    scene.add(Quad(width_m=1.0, height_m=1.0), NoiseSurface(), place((0.0, 0.0, 2.0)), "panel")
    M = np.array([[100.0, 0.0, 31.5], [0.0, 100.0, 23.5], [0.0, 0.0, 1.0]])
    with Renderer(scene, threads=1) as renderer:
        renderer.radiance(Projection(M=M, C=np.zeros(3), width=64, height=48))


def _expose() -> None:
    for bits in (8, 12):
        expose(np.zeros((4, 64), np.float32), SensorExposure(bits=bits), (0, 0, 0))


def warm_up(progress: Progress = _silent) -> None:
    """Compile or load all kernels and tables."""
    steps: list[tuple[str, Callable[[], object]]] = [
        ("noise tile", noise_levels),
        ("renderer", _render),
        ("sensor", _expose),
    ]
    for done, (name, step) in enumerate(steps):
        progress(done, len(steps), name)
        step()
    progress(len(steps), len(steps), "ready")
