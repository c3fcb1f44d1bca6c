"""Noise and bitmap materials averaged over the footprint of a pixel, and the colour of a batch's runs.

A footprint selects the mip levels of a noise layer or bitmap; a stretched one takes several fetches along it.
Cell materials are in `cells`.
"""

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.jit import part
from foveacam_hardware.sim.render.batch import PixelBatch
from foveacam_hardware.sim.render.fetch import LONG, fetch_long, fetch_short, lookup
from foveacam_hardware.sim.render.items import JUX, JUY, JVX, JVY, LookupItems, U, V
from foveacam_hardware.sim.render.materials import BITMAP, MAX_LAYERS, NOISE, MaterialTables
from foveacam_hardware.sim.render.noise_material import LEVELS, SHORTEST, TILE

MAX_TAPS, MESH_TAPS = 8, 4
"""Most taps on a flat face, and on a smooth mesh, whose footprints are stretched only at its outline."""
TAP_SPREAD = 2.2
"""Base of the triangular weights over the taps, in pixels."""
TAP_STEP = 1.5
"""Distance of the taps, in widths of a tap: half the shortest wavelength that a tap passes (CUT_PX)."""
ROUND = 1.15
"""Up to this ratio of length to width a footprint counts as round."""
F64 = NDArray[np.float64]
F32 = NDArray[np.float32]
I32 = NDArray[np.int32]
CUT_PX = 2.6
"""Shortest wavelength passed, in pixels; shorter ones would alias."""
CUT_HALVED_PX = 2.2
"""The same where pixels are means of 2x2. At 2.0 to 2.2 it differs least from averaged full-size pictures."""


@part
def footprint_filter(
    ux: float, uy: float, vx: float, vy: float, most: int
) -> tuple[float, float, int, float, float]:
    """Return the filter over the footprint of a pixel, metres.

    Its long axis (u, v); the number of taps along it, `most` at most; the width of one tap, and of all
    together.
    """
    p, r, s = ux * ux + uy * uy, vx * vx + vy * vy, ux * vx + uy * vy
    d = 0.5 * (p - r)
    spread = np.sqrt(d * d + s * s)
    long = max(np.sqrt(0.5 * (p + r) + spread), 1e-300)
    short = max(abs(ux * vy - uy * vx) / long, 1e-300)
    if long <= ROUND * short:
        return long, 0.0, 1, long, long
    # Half the angle of (d, s) by its tangent: (spread + d, s) or, where that vanishes, (s, spread − d).
    a, b = (spread + d, s) if d >= 0.0 else (s, spread - d)
    scale = long / np.sqrt(a * a + b * b)
    taps = int(min(float(most), np.ceil(TAP_SPREAD / TAP_STEP * long / short)))
    return scale * a, scale * b, taps, max(short, TAP_SPREAD / TAP_STEP * long / taps), long


@part
def tap(k: int, taps: int) -> tuple[float, float]:
    """Return the position of tap k along the long axis, in pixels, and its triangular weight (sum 1)."""
    at = (k + 0.5) / taps - 0.5
    total = 0.5 * taps if taps % 2 == 0 else 0.5 * (taps * taps + 1) / taps
    return at * TAP_SPREAD, (1.0 - 2.0 * abs(at)) / total


@part
def shade_noise(items: LookupItems, count: int, smooth: I32, tables: MaterialTables, cut_px: float) -> None:
    """Fill the values of all noise items with the sum of the layers that the footprint passes."""
    begin, end, obj, sides, where = items.begin, items.end, items.obj, items.side, items.where
    du, dv, out, texel, part_x, part_y = (
        items.du,
        items.dv,
        items.value[0],
        items.texel,
        items.part_x,
        items.part_y,
    )
    kind, layers, noise = tables.kind, tables.layers, tables.noise
    for m in range(count):
        j = obj[m]
        if kind[j] != NOISE:
            continue
        a, b = np.uintp(begin[m]), np.uintp(end[m])
        for i in range(a, b):
            out[i] = np.float32(0.0)
        au, av, taps, narrow, long = footprint_filter(
            where[m, JUX], where[m, JUY], where[m, JVX], where[m, JVY], MESH_TAPS if smooth[j] else MAX_TAPS
        )
        unit = cut_px / SHORTEST / layers[j, 0, 0]
        fine, coarse = np.log2(unit * narrow), np.log2(unit * long)
        for layer in range(MAX_LAYERS):
            if layers[j, layer, 0] == 0.0 or fine >= LEVELS:
                break
            grid = (layers[j, layer, 1], layers[j, layer, 2], layers[j, layer, 3], layers[j, layer, 4])
            # Opposite and neighbouring faces show different parts of the tile.
            u = (
                grid[0] * where[m, U]
                + grid[1] * where[m, V]
                + TILE * (layers[j, layer, 5] + 0.381966 * sides[m])
            )
            v = (
                grid[2] * where[m, U]
                + grid[3] * where[m, V]
                + TILE * (layers[j, layer, 5] * 7.0 + 0.276393 * sides[m])
            )
            needed = 1 if coarse <= 0.0 else taps
            low = int(max(0.0, fine))
            part = max(0.0, fine) - low
            tap_u, tap_v = grid[0] * au + grid[1] * av, grid[2] * au + grid[3] * av
            for up in range(2 if part > 0.0 and low + 1 < LEVELS else 1):
                at = lookup(u, v, grid, low + up)
                amplitude = layers[j, layer, 6] * (part if up else 1.0 - part)
                for k in range(needed):
                    along, share = tap(k, needed)
                    tu, tv, w = along * tap_u, along * tap_v, amplitude * share
                    if b - a < LONG:
                        fetch_short(at, tu, tv, w, du, dv, a, b, noise, out)
                    else:
                        fetch_long(at, tu, tv, w, du, dv, a, b, noise, out, texel, part_x, part_y)
            fine += 4.0  # log2 of RATIO: the next layer's texels are as much smaller
            coarse += 4.0


@part
def paint(
    batch: PixelBatch, runs: int, objs: I32, tables: MaterialTables, sky: F64, luma: F64, out: F32
) -> None:
    """Convert light and shade into radiance; out: (CAPACITY, channels).

    2 and 4 channels are 1 and 3 colours and the coverage: 1 on an object, 0 in the sky.
    """
    covers = out.shape[1] % 2 == 0
    colours = out.shape[1] - 1 if covers else out.shape[1]
    face, start, shade, light = batch.face, batch.first, batch.shade, batch.light
    kind, colors = tables.kind, tables.colors
    r, g, w = np.float32(luma[0]), np.float32(luma[1]), np.float32(luma[2])
    for k in range(runs):
        f = face[k]
        a, b = np.uintp(start[k]), np.uintp(start[k + 1])
        j = objs[f] if f >= 0 else 0
        if covers:
            for i in range(a, b):
                out[i, colours] = np.float32(1.0 if f >= 0 else 0.0)
        if f >= 0 and kind[j] == BITMAP:
            for i in range(a, b):
                if colours == 1:
                    out[i, 0] = light[i] * (r * shade[0, i] + g * shade[1, i] + w * shade[2, i])
                else:
                    for c in range(3):
                        out[i, c] = light[i] * shade[c, i]
            continue
        for c in range(colours):
            low = np.float32(sky[0, c] if f < 0 else colors[j, 0, c])
            step = np.float32(sky[1, c] if f < 0 else colors[j, 1, c]) - low
            for i in range(a, b):
                lit = light[i] if f >= 0 else np.float32(1.0)
                out[i, c] = lit * (low + step * shade[0, i])


@part
def _mip(bitmap: F64, level: int) -> tuple[int, int, int, float]:
    """Return width, height and first texel of a level of a bitmap, and its texels per texel of level 0."""
    w, h, first, scale = int(bitmap[1]), int(bitmap[2]), int(bitmap[3]), 1.0
    for _ in range(level):
        if w == 1 and h == 1:
            break
        first += 3 * w * h
        w, h, scale = (w + 1) // 2, (h + 1) // 2, 0.5 * scale
    return w, h, first, scale


@part
def _add(x: float, y: float, mip: tuple[int, int, int, float], weight: float, texels: F32, out: F32) -> None:
    """Add weight · colour at texel (x, y) of level 0, fetched from `mip`, bilinear, edges repeated."""
    w, h, first, scale = mip
    x, y = min(max(x * scale - 0.5, 0.0), w - 1.0), min(max(y * scale - 0.5, 0.0), h - 1.0)
    j, i = int(x), int(y)
    fx, fy = x - j, y - i
    j1, i1 = min(j + 1, w - 1), min(i + 1, h - 1)
    a, b = np.uintp(first + 3 * (i * w + j)), np.uintp(first + 3 * (i * w + j1))
    p, q = np.uintp(first + 3 * (i1 * w + j)), np.uintp(first + 3 * (i1 * w + j1))
    for c in range(np.uintp(0), np.uintp(3)):
        top = (1.0 - fx) * texels[a + c] + fx * texels[b + c]
        low = (1.0 - fx) * texels[p + c] + fx * texels[q + c]
        out[c] += np.float32(weight * ((1.0 - fy) * top + fy * low))


@part
def shade_bitmap(items: LookupItems, count: int, tables: MaterialTables) -> None:
    """Fill the values of all bitmap items with their colours, averaged over each footprint."""
    begin, end, obj, where = items.begin, items.end, items.obj, items.where
    du, dv, value = items.du, items.dv, items.value
    kind, bitmaps, texels = tables.kind, tables.cells, tables.texels
    colour, taps_at = np.zeros(3, np.float32), np.empty((MAX_TAPS, 3))
    for m in range(count):
        j = obj[m]
        if kind[j] != BITMAP:
            continue
        bitmap = bitmaps[j]
        per_m = 1.0 / bitmap[0]
        u, v = where[m, U] * per_m + 0.5 * bitmap[1], where[m, V] * per_m + 0.5 * bitmap[2]
        au, av, taps, narrow, _ = footprint_filter(
            where[m, JUX], where[m, JUY], where[m, JVX], where[m, JVY], MAX_TAPS
        )
        level = max(0.0, np.log2(narrow * per_m))
        part = level - int(level)
        fine, coarse = _mip(bitmap, int(level)), _mip(bitmap, int(level) + 1)
        for k in range(taps):
            along, share = tap(k, taps)
            taps_at[k, 0], taps_at[k, 1], taps_at[k, 2] = along * au, along * av, share
        for i in range(begin[m], end[m]):
            colour[:] = np.float32(0.0)
            for k in range(taps):
                x, y = u + (du[i] + taps_at[k, 0]) * per_m, v + (dv[i] + taps_at[k, 1]) * per_m
                _add(x, y, fine, taps_at[k, 2] * (1.0 - part), texels, colour)
                if part > 0.0:
                    _add(x, y, coarse, taps_at[k, 2] * part, texels, colour)
            for c in range(3):
                value[c, i] = colour[c]
