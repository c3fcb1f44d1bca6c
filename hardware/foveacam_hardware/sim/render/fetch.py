"""Bilinear fetches from the periodic noise tile: the innermost loop of the renderer."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.jit import part
from foveacam_hardware.sim.render.noise_material import TILE, TILE_BITS

F32 = NDArray[np.float32]
I32 = NDArray[np.int32]

LONG = 16
"""Spans of at least this length are fetched in two passes, of which the compiler vectorises the first."""


class TexelSpan(NamedTuple):
    """Position of a span in one level of the tile: texel (u, v) plus a 2x2 matrix times (du, dv)."""

    u: np.float32
    v: np.float32
    u_du: np.float32
    u_dv: np.float32
    v_du: np.float32
    v_dv: np.float32
    scale: float  # of the level: texels of it per texel of level 0
    base: np.int32  # the level's first texel
    bits: np.int32  # log2 of its width


@part
def lookup(u: float, v: float, grid: tuple[float, float, float, float], level: int) -> TexelSpan:
    """Return the span at texel (u, v) of level 0, with `grid` texels of it per metre, in another level."""
    size, scale = float(TILE), 1.0 / (1 << level)
    first = (4 * TILE * TILE - ((4 * TILE * TILE) >> (2 * level))) // 3
    return TexelSpan(
        np.float32((u - np.floor(u / size) * size) * scale),
        np.float32((v - np.floor(v / size) * size) * scale),
        np.float32(grid[0] * scale),
        np.float32(grid[1] * scale),
        np.float32(grid[2] * scale),
        np.float32(grid[3] * scale),
        scale,
        np.int32(first),
        np.int32(TILE_BITS - level),
    )


@part
def fetch_short(
    at: TexelSpan, u: float, v: float, w: float, du: F32, dv: F32, a: int, b: int, noise: F32, out: F32
) -> None:
    """Add w times the noise of pixels a..b, offset by texels (u, v) of level 0."""
    u0, v0, u_du, u_dv, v_du, v_dv, scale, base, bits = at
    u0, v0, weight = u0 + np.float32(u * scale), v0 + np.float32(v * scale), np.float32(w)
    one = np.int32(1)
    mask = (one << bits) - one
    for i in range(a, b):
        x, y = u0 + du[i] * u_du + dv[i] * u_dv, v0 + du[i] * v_du + dv[i] * v_dv
        fx, fy = np.floor(x), np.floor(y)
        c, r = np.int32(fx) & mask, np.int32(fy) & mask
        c1, r1 = (c + one) & mask, base + (((r + one) & mask) << bits)
        r = base + (r << bits)
        x -= fx
        y -= fy
        p, q = noise[np.uint32(r + c)], noise[np.uint32(r1 + c)]
        p += x * (noise[np.uint32(r + c1)] - p)
        q += x * (noise[np.uint32(r1 + c1)] - q)
        out[i] += weight * (p + y * (q - p))


@part
def fetch_long(
    at: TexelSpan,
    u: float,
    v: float,
    w: float,
    du: F32,
    dv: F32,
    a: int,
    b: int,
    noise: F32,
    out: F32,
    texel: I32,
    part_x: F32,
    part_y: F32,
) -> None:
    """Compute bit for bit what `fetch_short` does, in two passes over three work arrays as long as `du`."""
    u0, v0, u_du, u_dv, v_du, v_dv, scale, base, bits = at
    u0, v0, weight = u0 + np.float32(u * scale), v0 + np.float32(v * scale), np.float32(w)
    one = np.int32(1)
    mask, width = (one << bits) - one, one << bits
    last = (width << bits) - one
    for i in range(a, b):
        x, y = u0 + du[i] * u_du + dv[i] * u_dv, v0 + du[i] * v_du + dv[i] * v_dv
        fx, fy = np.floor(x), np.floor(y)
        texel[i] = ((np.int32(fy) & mask) << bits) + (np.int32(fx) & mask)
        part_x[i], part_y[i] = x - fx, y - fy
    for i in range(a, b):
        k = texel[i]
        right = ((k + one) & mask) - (k & mask)
        below = base + ((k + width) & last)
        k += base
        p, q = noise[np.uint32(k)], noise[np.uint32(below)]
        p += part_x[i] * (noise[np.uint32(k + right)] - p)
        q += part_x[i] * (noise[np.uint32(below + right)] - q)
        out[i] += weight * (p + part_y[i] * (q - p))
