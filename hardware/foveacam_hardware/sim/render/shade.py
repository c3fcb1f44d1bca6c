"""The noise of a batch's items, and the colour of its runs.

Noise is filtered by choosing mip levels of its layers by the footprint of a pixel on the face, with several
fetches along a stretched one.
"""

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.jit import inlined
from foveacam_hardware.sim.render.batch import PixelBatch
from foveacam_hardware.sim.render.fetch import LONG, fetch_long, fetch_short, lookup
from foveacam_hardware.sim.render.footprint import MAX_TAPS, MESH_TAPS, footprint_filter, tap
from foveacam_hardware.sim.render.items import JUX, JUY, JVX, JVY, LookupItems, U, V
from foveacam_hardware.sim.render.materials import BITMAP, MAX_LAYERS, NOISE, MaterialTables
from foveacam_hardware.sim.render.noise import LEVELS, SHORTEST, TILE

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]
I32 = NDArray[np.int32]

CUT_PX = 2.6
"""Shortest wavelength let through, in pixels: what is shorter would alias."""


@inlined
def shade_noise(items: LookupItems, count: int, smooth: I32, tables: MaterialTables) -> None:
    """Fill the values of all items of noise with the sum of the layers that the footprint lets through."""
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
        unit = CUT_PX / SHORTEST / layers[j, 0, 0]
        fine, coarse = np.log2(unit * narrow), np.log2(unit * long)
        for layer in range(MAX_LAYERS):
            if layers[j, layer, 0] == 0.0 or fine >= LEVELS:
                break
            grid = (layers[j, layer, 1], layers[j, layer, 2], layers[j, layer, 3], layers[j, layer, 4])
            # Opposite and neighbouring faces show other parts of the tile.
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


@inlined
def paint(
    batch: PixelBatch, runs: int, objs: I32, tables: MaterialTables, sky: F64, luma: F64, out: F32
) -> None:
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
