"""The tile rasteriser: radiance, depth and identity of what a camera sees, and the sensor behind the lens."""

from foveacam_hardware.sim.render.materials import (
    BitmapSurface,
    CellSurface,
    Color,
    Material,
    NoiseSurface,
    PlainSurface,
)
from foveacam_hardware.sim.render.projection import Projection, RayTable
from foveacam_hardware.sim.render.renderer import Radiance, Renderer
from foveacam_hardware.sim.render.scene import Lighting, Scene
from foveacam_hardware.sim.render.sensor import SensorExposure, expose
from foveacam_hardware.sim.render.shapes import (
    Box,
    Mesh,
    Quad,
    Shape,
    column,
    flat,
    ground,
    place,
    sphere,
    statue,
)
from foveacam_hardware.sim.render.warm import warm_up

__all__ = [
    "BitmapSurface",
    "Box",
    "CellSurface",
    "Color",
    "Lighting",
    "Material",
    "Mesh",
    "NoiseSurface",
    "PlainSurface",
    "Projection",
    "Quad",
    "Radiance",
    "RayTable",
    "Renderer",
    "Scene",
    "SensorExposure",
    "Shape",
    "column",
    "expose",
    "flat",
    "ground",
    "place",
    "sphere",
    "statue",
    "warm_up",
]
