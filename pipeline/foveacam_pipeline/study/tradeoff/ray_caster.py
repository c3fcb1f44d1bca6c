"""A small ray caster for axis-aligned rectangles with texture, which renders the scenes of Sec. 4.2.

Depth is exact; the left camera is at the origin, OpenCV's axes, metres. Texture is a function of the point
that a ray hits, so that both eyes see the same, and has no detail finer than the pixels there.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]
COARSEST_M = 4.0
OCTAVES = 9
GREY_LEVELS = 14.0
"""Amplitude of every octave: as in natural images, each octave has the same contrast."""
FADE_PX = (2.0, 4.0)
"""A wave shorter than the first is left out; from the second on it has its full amplitude."""
LATTICE = 256
SKY_LEVEL = 205.0


@dataclass(frozen=True, slots=True, kw_only=True)
class PinholeCamera:
    """A camera without distortion; pixel (x, y) looks along ((x - cx) / f, (y - cy) / f, 1)."""

    f_px: float
    cx_px: float
    cy_px: float
    width: int
    height: int


@dataclass(frozen=True, slots=True, kw_only=True)
class RectangleFace:
    """A rectangle across `axis` (0: x, 1: y, 2: z), between the corners `low_m` and `high_m`, (x, y, z) m.

    The corners agree along `axis`. `level`: its mean brightness, grey levels; `color`: RGB shares of it.
    """

    axis: int
    low_m: tuple[float, float, float]
    high_m: tuple[float, float, float]
    level: float = 120.0
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class RenderedView:
    """`image`: (h, w, 3) float32 grey levels before noise. `z_m`: (h, w) float64, infinite in the sky."""

    image: NDArray[np.float32]
    z_m: Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class RayHits:
    """Points that rays hit, and the width of a pixel there, (n,) each."""

    x_m: Floats
    y_m: Floats
    z_m: Floats
    pixel_m: Floats


def render_view(
    faces: Sequence[RectangleFace], camera: PinholeCamera, *, eye_x_m: float, lattice: Floats
) -> RenderedView:
    """Return the view of a camera at (eye_x_m, 0, 0).

    `lattice`: (256, 256), -1 to 1, noise of the textures.
    """
    along_x: Floats = np.asarray((np.arange(camera.width) - camera.cx_px) / camera.f_px, dtype=np.float64)
    along_y: Floats = np.asarray((np.arange(camera.height) - camera.cy_px) / camera.f_px, dtype=np.float64)
    z_m = np.full((camera.height, camera.width), np.inf)
    seen = np.full(z_m.shape, -1, dtype=np.intp)
    for index, face in enumerate(faces):
        window = _window(face, along_x, along_y, eye_x_m)
        depth_m = _depth_m(face, along_x[window[1]], along_y[window[0]], eye_x_m)
        nearer = depth_m < z_m[window]
        z_m[window] = np.where(nearer, depth_m, z_m[window])
        seen[window] = np.where(nearer, index, seen[window])
    image = np.full((*z_m.shape, 3), SKY_LEVEL, dtype=np.float32)
    for index, face in enumerate(faces):
        rows, columns = np.nonzero(seen == index)
        depth_m = z_m[rows, columns]
        hit = RayHits(
            x_m=eye_x_m + along_x[columns] * depth_m,
            y_m=along_y[rows] * depth_m,
            z_m=depth_m,
            pixel_m=depth_m / camera.f_px,
        )
        grey = face.level + GREY_LEVELS * _texture(hit, face, lattice, number=index)
        image[rows, columns] = grey[:, None] * np.asarray(face.color)
    return RenderedView(image=image, z_m=z_m)


def _window(face: RectangleFace, along_x: Floats, along_y: Floats, eye_x_m: float) -> tuple[slice, slice]:
    """Return the rows and columns in which the face can be seen."""
    spans = []
    for axis, along, eye_m in ((1, along_y, 0.0), (0, along_x, eye_x_m)):
        corners = [
            (side[axis] - eye_m) / depth[2]
            for side in (face.low_m, face.high_m)
            for depth in (face.low_m, face.high_m)
        ]
        first, last = np.searchsorted(along, [min(corners), max(corners)], side="left")
        spans.append(slice(int(first), int(min(last + 1, len(along)))))
    return spans[0], spans[1]


def _depth_m(face: RectangleFace, along_x: Floats, along_y: Floats, eye_x_m: float) -> Floats:
    """Return (rows, columns) depth at which rays hit the face, infinite where they miss."""
    shape = (len(along_y), len(along_x))
    with np.errstate(divide="ignore", invalid="ignore"):
        if face.axis == 0:
            depth_m = np.broadcast_to((face.low_m[0] - eye_x_m) / along_x[None, :], shape)
        elif face.axis == 1:
            depth_m = np.broadcast_to(face.low_m[1] / along_y[:, None], shape)
        else:
            depth_m = np.full(shape, face.low_m[2])
        hits = np.isfinite(depth_m) & (depth_m > 0.0)
        for axis, at_m in (
            (0, eye_x_m + along_x[None, :] * depth_m),
            (1, along_y[:, None] * depth_m),
            (2, depth_m),
        ):
            if axis != face.axis:
                hits &= (at_m >= face.low_m[axis]) & (at_m <= face.high_m[axis])
    return np.where(hits, depth_m, np.inf)


def _texture(hit: RayHits, face: RectangleFace, lattice: Floats, *, number: int) -> Floats:
    """Return (n,) texture at the points, octaves of smooth noise, each of amplitude 1.

    Along z the texture coordinate is the logarithm of the depth: a wave then keeps its width in pixels on
    slanted faces, on the ground as on the walls beside it.
    """
    aside_m = abs(face.low_m[face.axis])
    slanted_m = aside_m * np.log(hit.z_m)
    u_m = slanted_m if face.axis == 0 else hit.x_m
    v_m = slanted_m if face.axis == 1 else hit.y_m
    total = np.zeros(len(u_m))
    for octave in range(OCTAVES):
        wave_m = COARSEST_M / 2.0**octave
        low, high = FADE_PX
        strength = np.clip((wave_m / hit.pixel_m - low) / (high - low), 0.0, 1.0)
        shown = np.nonzero(strength > 0.0)[0]
        if len(shown):
            shift = math.e * (number + 1) + 31.0 * octave
            total[shown] += strength[shown] * _noise(
                u_m[shown] / wave_m + shift, v_m[shown] / wave_m + 2.0 * shift, lattice
            )
    return total


def _noise(u: Floats, v: Floats, lattice: Floats) -> Floats:
    """Return (n,) noise, smooth between the nodes of the lattice, which repeats."""
    left, top = np.floor(u), np.floor(v)
    across, down = u - left, v - top
    across *= across * (3.0 - 2.0 * across)
    down *= down * (3.0 - 2.0 * down)
    columns, rows = left.astype(np.intp) % LATTICE, top.astype(np.intp) % LATTICE
    after, below = (columns + 1) % LATTICE, (rows + 1) % LATTICE
    upper = lattice[rows, columns] * (1.0 - across) + lattice[rows, after] * across
    lower = lattice[below, columns] * (1.0 - across) + lattice[below, after] * across
    return np.asarray(upper * (1.0 - down) + lower * down)
