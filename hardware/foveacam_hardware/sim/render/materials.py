"""Materials: procedural noise, one colour, cells (boards, markers), bitmaps; linear, 0..1.

`pack` converts them into the flat tables that the kernels read. Coordinates (u, v) are metres in the plane of
the face, (x, y) on a quad; meshes are mapped along the axis nearest to their normal.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract.errors import InvalidInput
from foveacam_hardware.sim.render.noise_material import LONGEST, RATIO, noise_levels

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]
I32 = NDArray[np.int32]
Color = tuple[float, float, float]
"""Red, green, blue, linear, 0..1."""

PLAIN, NOISE, CELLS, BITMAP = 0, 1, 2, 3
MAX_LAYERS = 6
LUMA = np.array([0.299, 0.587, 0.114])
"""Weights of red, green and blue in a mono camera's reading (ITU-R BT.601)."""


def _color(name: str, color: Color) -> None:
    if len(color) != 3 or not all(0.0 <= c <= 1.0 for c in color):
        raise InvalidInput(f"{name} = {color}: pass red, green, blue, each 0..1")


@dataclass(frozen=True, kw_only=True, slots=True)
class NoiseSurface:
    """Many octaves of noise between two colours: texture at every scale on a surface of any size.

    Attributes:
        contrast: 1 = a standard deviation of 0.06 of the way from a to b in each octave.
        scale_m: longest wavelength.
        grain_m: shortest wavelength.
        stretch: stretch of the pattern (wood, brushed metal), above 1 along u, below 1 along v by 1/stretch.
    """

    seed: int = 0
    color_a: Color = (0.25, 0.22, 0.2)
    color_b: Color = (0.85, 0.8, 0.72)
    contrast: float = 1.0
    scale_m: float = 1.0
    grain_m: float = 1e-4
    stretch: float = 1.0

    def __post_init__(self) -> None:
        _color("color_a", self.color_a)
        _color("color_b", self.color_b)
        for name in ("contrast", "scale_m", "grain_m", "stretch"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise InvalidInput(f"noise: {name} = {value}; pass a finite number above 0")
        if self.grain_m >= self.scale_m:
            raise InvalidInput(f"noise: grain_m {self.grain_m} must be below scale_m {self.scale_m}")


@dataclass(frozen=True, kw_only=True, slots=True)
class PlainSurface:
    """One colour without texture, which a stereo matcher must refuse."""

    color: Color = (0.7, 0.7, 0.7)

    def __post_init__(self) -> None:
        _color("color", self.color)


@dataclass(frozen=True, kw_only=True, eq=False)
class CellSurface:
    """Square cells of two colours about the face's centre: checkerboards, ArUco markers.

    Attributes:
        cells: (rows, columns), false or 0 = `color_0`, true or 1 = `color_1`; row 0 is at the top (−v).
        cell_m: side of a cell.
        outside: which of the two colours surrounds the cells.
    """

    cells: NDArray[np.bool_]
    cell_m: float
    color_0: Color = (0.03, 0.03, 0.03)
    color_1: Color = (0.9, 0.9, 0.9)
    outside: int = 1

    def __post_init__(self) -> None:
        _color("color_0", self.color_0)
        _color("color_1", self.color_1)
        cells = np.asarray(self.cells).astype(bool)
        if cells.ndim != 2 or cells.size == 0:
            raise InvalidInput(f"cells: asked for (rows, columns), found shape {cells.shape}")
        if not (np.isfinite(self.cell_m) and self.cell_m > 0):
            raise InvalidInput(f"cells: cell_m = {self.cell_m}; pass a finite length above 0")
        if self.outside not in (0, 1):
            raise InvalidInput(f"cells: outside = {self.outside}; pass 0 or 1")
        object.__setattr__(self, "cells", cells)


@dataclass(frozen=True, kw_only=True, eq=False)
class BitmapSurface:
    """A bitmap about the face's centre, `width_m` wide, as high as its proportions say; its edges repeat."""

    rgb: NDArray[np.uint8]
    width_m: float

    def __post_init__(self) -> None:
        rgb = np.asarray(self.rgb)
        if rgb.ndim != 3 or rgb.shape[2] != 3 or rgb.dtype != np.uint8 or rgb.size == 0:
            raise InvalidInput(f"bitmap: asked for (h, w, 3) uint8, found {rgb.shape} {rgb.dtype}")
        if not (np.isfinite(self.width_m) and self.width_m > 0):
            raise InvalidInput(f"bitmap: width_m = {self.width_m}; pass a finite length above 0")


Material = NoiseSurface | PlainSurface | CellSurface | BitmapSurface


class MaterialTables(NamedTuple):
    """All materials as flat arrays, one row each."""

    kind: I32  # (n,)
    colors: F64  # (n, 2, 3): at shade 0 and at shade 1
    stretch: F64  # (n, 2): factors on u and v
    layers: (
        F64  # (n, MAX_LAYERS, 7): texel_m, four of the matrix texels_from_uv, seed of the offset, amplitude
    )
    cells: F64  # (n, 5): cell_m or texel_m, columns, rows, first entry in sums or texels, value outside
    sums: F64  # summed-area tables of all cell materials, one after another
    texels: F32  # mip levels of all bitmaps, one after another, (h, w, 3) each
    noise: F32  # the noise tile's levels


def _noise_layers(material: NoiseSurface) -> F64:
    """Return (MAX_LAYERS, 7): from the longest wavelengths to the grain, each layer rotated further."""
    layers: F64 = np.zeros((MAX_LAYERS, 7))
    rng = np.random.default_rng([material.seed & 0xFFFFFFFF, 0x0F0E])
    # With an irrational slope the tile does not repeat along the rows and columns that a matcher searches.
    turn = np.arctan((np.sqrt(5) - 1) / 2) + rng.uniform(-0.15, 0.15)
    texel_m = material.scale_m / LONGEST
    for layer in range(MAX_LAYERS):
        if texel_m * LONGEST <= material.grain_m:
            break
        angle = turn + 2.4 * layer
        c, s = np.cos(angle) / texel_m, np.sin(angle) / texel_m
        layers[layer] = [texel_m, c, -s, s, c, rng.uniform(0, 1), 0.06 * material.contrast]
        texel_m /= RATIO
    return layers


def _summed(cells: NDArray[np.bool_]) -> F64:
    """Return the summed-area table, (rows + 1, columns + 1), row by row."""
    table = np.zeros((cells.shape[0] + 1, cells.shape[1] + 1))
    table[1:, 1:] = np.cumsum(np.cumsum(cells.astype(np.float64), axis=0), axis=1)
    return table.ravel()


def _mips(rgb: NDArray[np.uint8]) -> F32:
    """Return all levels (2x2 means, the last row and column repeated when odd), flat."""
    level: F32 = rgb.astype(np.float32) / np.float32(255)
    levels = [level.ravel()]
    while level.shape[:2] != (1, 1):
        h, w = level.shape[:2]
        level = np.pad(level, ((0, h % 2), (0, w % 2), (0, 0)), mode="edge")
        level = (level[0::2, 0::2] + level[1::2, 0::2] + level[0::2, 1::2] + level[1::2, 1::2]) / np.float32(
            4
        )
        levels.append(level.ravel())
    flat: F32 = np.concatenate(levels)
    return flat


class _Packer:
    """Fills the tables row by row."""

    def __init__(self, count: int) -> None:
        self.kind: I32 = np.zeros(count, np.int32)
        self.colors: F64 = np.zeros((count, 2, 3))
        self.stretch: F64 = np.ones((count, 2))
        self.layers: F64 = np.zeros((count, MAX_LAYERS, 7))
        self.cells: F64 = np.zeros((count, 5))
        self.sums: list[F64] = []
        self.texels: list[F32] = []
        self._summed, self._texels = 0, 0

    def set_row(self, i: int, material: Material) -> None:
        if isinstance(material, PlainSurface):
            self.kind[i], self.colors[i] = PLAIN, material.color
        elif isinstance(material, NoiseSurface):
            self.kind[i] = NOISE
            self.stretch[i] = 1.0 / max(material.stretch, 1.0), min(material.stretch, 1.0)
            self.colors[i] = material.color_a, material.color_b
            self.layers[i] = _noise_layers(material)
        elif isinstance(material, CellSurface):
            rows, columns = material.cells.shape
            self.kind[i] = CELLS
            self.colors[i] = material.color_0, material.color_1
            self.cells[i] = material.cell_m, columns, rows, self._summed, material.outside
            self.sums.append(_summed(material.cells))
            self._summed += self.sums[-1].size
        else:
            height, width = material.rgb.shape[:2]
            self.kind[i] = BITMAP
            self.cells[i] = material.width_m / width, width, height, self._texels, 0
            self.texels.append(_mips(material.rgb))
            self._texels += self.texels[-1].size


def pack(materials: list[Material]) -> MaterialTables:
    """Return the tables of all materials, row i for material i."""
    packer = _Packer(max(len(materials), 1))
    for i, material in enumerate(materials):
        packer.set_row(i, material)
    return MaterialTables(
        packer.kind,
        packer.colors,
        packer.stretch,
        packer.layers,
        packer.cells,
        np.concatenate([*packer.sums, np.zeros(1)]),
        np.concatenate([*packer.texels, np.zeros(3, np.float32)]),
        noise_levels(),
    )
