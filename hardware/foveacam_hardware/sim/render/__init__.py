"""The tile rasteriser: radiance, depth and object numbers in a camera's image, and the image sensor."""

from foveacam_hardware.sim.render.compilation import warm_up
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
