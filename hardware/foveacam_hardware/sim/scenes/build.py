"""Converts a scene file into the renderer's scene: shapes, materials and prints."""

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_hardware.sim.render.materials import BitmapSurface, CellSurface, NoiseSurface, PlainSurface
from foveacam_hardware.sim.render.materials import Material as RenderMaterial
from foveacam_hardware.sim.render.scene import Lighting, Scene
from foveacam_hardware.sim.render.shapes import Box, Quad, Shape, column, figurine, sphere, truncated_cone
from foveacam_hardware.sim.scenes.format import (
    BoxObject,
    ColumnObject,
    Object,
    QuadObject,
    SceneFile,
    SphereObject,
)
from foveacam_hardware.sim.scenes.materials import (
    CharucoMaterial,
    CheckerboardMaterial,
    MarkerMaterial,
    Material,
    NoiseMaterial,
    PictureMaterial,
    PlainMaterial,
    PrintMaterial,
)
from foveacam_hardware.sim.scenes.motion import pose

PRINT_TEXELS = 1024  # of the longer side; about 1 mm on a poster
PRINT_GRAIN = 0.05
MARKER_CELLS = 8  # 4 x 4 bits, a black ring, and one cell of white border
DICTIONARY = cv2.aruco.DICT_4X4_50


def build_scene(file: SceneFile, *, folder: Path) -> Scene:
    """Return the renderer's scene with every object at its pose at time 0."""
    light = file.light
    scene = Scene(
        Lighting(lamp=light.towards, ambient=light.ambient, horizon=light.horizon, zenith=light.zenith)
    )
    materials = {name: _material(name, given, folder) for name, given in file.materials.items()}
    for entry in file.objects:
        scene.add(_shape(entry), materials[entry.material], pose(entry, 0.0), entry.name)
    return scene


def _shape(entry: Object) -> Shape:
    if isinstance(entry, QuadObject):
        return Quad(width_m=entry.size_m[0], height_m=entry.size_m[1])
    if isinstance(entry, BoxObject):
        return Box(width_m=entry.size_m[0], height_m=entry.size_m[1], depth_m=entry.size_m[2])
    if isinstance(entry, SphereObject):
        return sphere(radius_m=entry.radius_m, rings=entry.facets)
    if isinstance(entry, ColumnObject):
        if entry.top_radius_m is None:
            return column(radius_m=entry.radius_m, height_m=entry.height_m, sides=entry.sides, bands=1)
        return truncated_cone(
            radius_m=entry.radius_m,
            top_radius_m=entry.top_radius_m,
            height_m=entry.height_m,
            sides=entry.sides,
        )
    return figurine(height_m=entry.height_m, triangles=entry.triangles)


def _material(name: str, given: Material, folder: Path) -> RenderMaterial:
    if isinstance(given, PlainMaterial):
        return PlainSurface(color=given.color)
    if isinstance(given, NoiseMaterial):
        return NoiseSurface(
            seed=given.seed,
            color_a=given.color,
            color_b=given.accent,
            contrast=given.contrast,
            scale_m=given.coarsest_m,
            grain_m=given.finest_m,
            stretch=given.stretch,
        )
    if isinstance(given, CheckerboardMaterial):
        dark = np.indices((given.rows, given.columns)).sum(axis=0) % 2 == 0
        return _cells(~dark, given.square_m, given.color, given.accent)
    if isinstance(given, CharucoMaterial):
        return _cells(_charuco(given), given.square_m / MARKER_CELLS, given.color, given.accent)
    if isinstance(given, MarkerMaterial):
        return _cells(_marker(given.id), given.side_m / (MARKER_CELLS - 2), given.color, given.accent)
    if isinstance(given, PrintMaterial):
        return BitmapSurface(rgb=_print(given), width_m=given.width_m)
    return _picture(name, given, folder)


def _cells(
    light: NDArray[np.bool_], cell_m: float, color: tuple[float, ...], accent: tuple[float, ...]
) -> CellSurface:
    (r0, g0, b0), (r1, g1, b1) = accent, color
    return CellSurface(cells=light, cell_m=cell_m, color_0=(r0, g0, b0), color_1=(r1, g1, b1), outside=1)


def _marker(number: int) -> NDArray[np.bool_]:
    """Return the cells of an ArUco marker with its border, true = white."""
    dictionary = cv2.aruco.getPredefinedDictionary(DICTIONARY)
    picture = cv2.aruco.generateImageMarker(dictionary, number, MARKER_CELLS - 2)
    return np.pad(np.asarray(picture) > 127, 1, constant_values=True)


def _charuco(given: CharucoMaterial) -> NDArray[np.bool_]:
    """Return the cells of a ChArUco board, 8 per side of a square, true = white; the first square is dark."""
    cells = np.zeros((given.rows * MARKER_CELLS, given.columns * MARKER_CELLS), bool)
    light = np.argwhere(np.indices((given.rows, given.columns)).sum(axis=0) % 2 == 1) * MARKER_CELLS
    for number, (down, across) in enumerate(light):
        cells[down : down + MARKER_CELLS, across : across + MARKER_CELLS] = _marker(number)
    return cells


def _print(given: PrintMaterial) -> NDArray[np.uint8]:
    """Return lines of text, drawn as large as they fit, (h, w, 3) RGB."""
    across_m, down_m = given.width_m, given.height_m
    if given.upright:
        across_m, down_m = down_m, across_m
    scale = PRINT_TEXELS / max(across_m, down_m)
    width, height = max(8, round(across_m * scale)), max(8, round(down_m * scale))
    sheet = np.empty((height, width, 3), np.uint8)
    sheet[:] = _bytes(given.color)
    frame = max(2, min(width, height) // 24)
    cv2.rectangle(sheet, (frame, frame), (width - frame, height - frame), _bytes(given.accent), frame // 2)
    lines = given.text.splitlines()
    for i, line in enumerate(lines):
        _write(sheet, line, _bytes(given.accent), row=(i + 0.5) / len(lines), rows=len(lines))
    sheet = _grained(sheet)
    return np.ascontiguousarray(np.rot90(sheet, -1)) if given.upright else sheet


def _grained(sheet: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return a print with the grain of paper, without which its flat areas would have no texture."""
    rng = np.random.default_rng(sheet.shape[:2])
    grain = np.zeros(sheet.shape[:2], np.float32)
    for blur_px in (0.0, 2.0, 8.0):
        layer = rng.standard_normal(sheet.shape[:2]).astype(np.float32)
        if blur_px:
            layer = np.asarray(cv2.GaussianBlur(layer, (0, 0), blur_px), np.float32)
        grain += layer / max(float(layer.std()), 1e-6)
    mottled = sheet * (1.0 + PRINT_GRAIN * grain[:, :, None])
    return np.asarray(np.clip(mottled + 0.5, 0, 255), np.uint8)


def _write(sheet: NDArray[np.uint8], line: str, ink: tuple[int, int, int], *, row: float, rows: int) -> None:
    height, width = sheet.shape[:2]
    font = cv2.FONT_HERSHEY_DUPLEX
    (wide, high), _ = cv2.getTextSize(line, font, 10.0, 20)
    size = min(0.8 * width / max(wide, 1), 0.6 * height / rows / max(high, 1)) * 10.0
    thick = max(1, round(2.2 * size))
    (wide, high), _ = cv2.getTextSize(line, font, size, thick)
    origin = (round((width - wide) / 2), round(row * (0.86 * height) + 0.07 * height + high / 2))
    cv2.putText(sheet, line, origin, font, size, ink, thick, cv2.LINE_AA)


def _bytes(color: tuple[float, ...]) -> tuple[int, int, int]:
    red, green, blue = (round(255 * part) for part in color)
    return red, green, blue


def _picture(name: str, given: PictureMaterial, folder: Path) -> BitmapSurface:
    path = folder / given.file
    bgr = cv2.imread(str(path), cv2.IMREAD_COLOR) if path.is_file() else None
    if bgr is None:
        raise InvalidInput(f"scene material {name!r}: no readable PNG or JPEG at {path}; correct `file`")
    return BitmapSurface(rgb=np.ascontiguousarray(bgr[:, :, ::-1]).astype(np.uint8), width_m=given.width_m)
