"""The noise of a batch's items, and the colour of its runs.

Noise is filtered by choosing mip levels of its layers by the footprint of a pixel on the face, with several
fetches along a stretched one.
"""

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.sim.render.batch import Batch
from foveacam_hardware.sim.render.footprint import footprint_filter
from foveacam_hardware.sim.render.items import JUX, JUY, JVX, JVY, Items, U, V
from foveacam_hardware.sim.render.jit import inlined
from foveacam_hardware.sim.render.materials import BITMAP, MAX_LAYERS, NOISE, Tables
from foveacam_hardware.sim.render.noise import LEVELS, SHORTEST, TILE

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]
I32 = NDArray[np.int32]

CUT_PX = 2.6
"""Shortest wavelength let through, in pixels: what is shorter would alias."""


@inlined
def shade_noise(items: Items, count: int, tables: Tables) -> None:
    """Fill the values of all items of noise with the sum of the layers that the footprint lets through."""
    first, obj, sides, where = items.first, items.obj, items.side, items.where
    du, dv, out = items.du, items.dv, items.value[0]
    kind, layers, noise = tables.kind, tables.layers, tables.noise
    one, size = np.int32(1), float(TILE)
    for m in range(count):
        j = obj[m]
        if kind[j] != NOISE:
            continue
        start, end = np.uintp(first[m]), np.uintp(first[m + 1])
        for i in range(start, end):
            out[i] = np.float32(0.0)
        au, av, taps, narrow, long = footprint_filter(
            where[m, JUX], where[m, JUY], where[m, JVX], where[m, JVY]
        )
        unit = CUT_PX / SHORTEST / layers[j, 0, 0]
        fine, coarse = np.log2(unit * narrow), np.log2(unit * long)
        for layer in range(MAX_LAYERS):
            if layers[j, layer, 0] == 0.0 or fine >= LEVELS:
                break
            g0, g1 = layers[j, layer, 1], layers[j, layer, 2]
            g2, g3 = layers[j, layer, 3], layers[j, layer, 4]
            # Opposite and neighbouring faces show other parts of the tile.
            u = g0 * where[m, U] + g1 * where[m, V] + TILE * (layers[j, layer, 5] + 0.381966 * sides[m])
            v = g2 * where[m, U] + g3 * where[m, V] + TILE * (layers[j, layer, 5] * 7.0 + 0.276393 * sides[m])
            needed = 1 if coarse <= 0.0 else taps
            low = int(max(0.0, fine))
            part = max(0.0, fine) - low
            levels = 2 if part > 0.0 and low + 1 < LEVELS else 1
            for step in range(needed * levels):
                at = (step // levels + 0.5) / needed - 0.5
                ut, vt = u + at * (g0 * au + g1 * av), v + at * (g2 * au + g3 * av)
                up = step % levels
                level = low + up
                w = np.float32(layers[j, layer, 6] / needed * (part if up else 1.0 - part))
                bits = np.int32(10 - level)
                mask = np.int32((TILE >> level) - 1)
                base = np.int32((4 * TILE * TILE - ((4 * TILE * TILE) >> (2 * level))) // 3)
                scale = 1.0 / (1 << level)
                x0, y0 = (
                    np.float32((ut - np.floor(ut / size) * size) * scale),
                    np.float32((vt - np.floor(vt / size) * size) * scale),
                )
                xu, xv, yu, yv = (
                    np.float32(g0 * scale),
                    np.float32(g1 * scale),
                    np.float32(g2 * scale),
                    np.float32(g3 * scale),
                )
                for i in range(start, end):
                    x = x0 + du[i] * xu + dv[i] * xv
                    y = y0 + du[i] * yu + dv[i] * yv
                    fx, fy = np.floor(x), np.floor(y)
                    c, r = np.int32(fx) & mask, np.int32(fy) & mask
                    c1, r1 = (c + one) & mask, base + (((r + one) & mask) << bits)
                    r = base + (r << bits)
                    x -= fx
                    y -= fy
                    p, q = noise[np.uint32(r + c)], noise[np.uint32(r1 + c)]
                    top = p + x * (noise[np.uint32(r + c1)] - p)
                    bottom = q + x * (noise[np.uint32(r1 + c1)] - q)
                    out[i] += w * (top + y * (bottom - top))
            fine += 4.0  # log2 of RATIO: the next layer's texels are as much smaller
            coarse += 4.0


@inlined
def paint(batch: Batch, runs: int, objs: I32, tables: Tables, sky: F64, luma: F64, out: F32) -> None:
    """Turn light and shade into radiance; out: (CAPACITY, channels)."""
    face, start, shade, light = batch.face, batch.first, batch.shade, batch.light
    kind, colors = tables.kind, tables.colors
    r, g, w = np.float32(luma[0]), np.float32(luma[1]), np.float32(luma[2])
    for k in range(runs):
        f = face[k]
        a, b = np.uintp(start[k]), np.uintp(start[k + 1])
        j = objs[f] if f >= 0 else 0
        if f >= 0 and kind[j] == BITMAP:
            for i in range(a, b):
                if out.shape[1] == 1:
                    out[i, 0] = light[i] * (r * shade[0, i] + g * shade[1, i] + w * shade[2, i])
                else:
                    for c in range(3):
                        out[i, c] = light[i] * shade[c, i]
            continue
        for c in range(out.shape[1]):
            low = np.float32(sky[0, c] if f < 0 else colors[j, 0, c])
            step = np.float32(sky[1, c] if f < 0 else colors[j, 1, c]) - low
            for i in range(a, b):
                lit = light[i] if f >= 0 else np.float32(1.0)
                out[i, c] = lit * (low + step * shade[0, i])
