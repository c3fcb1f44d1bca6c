"""Picture materials: a user's bitmap, filtered between mip levels, by several fetches along its footprint."""

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.jit import inlined, kernel
from foveacam_hardware.sim.render.footprint import MAX_TAPS, footprint_filter, tap
from foveacam_hardware.sim.render.items import JUX, JUY, JVX, JVY, LookupItems, U, V
from foveacam_hardware.sim.render.materials import BITMAP, MaterialTables

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]


@kernel
def _add(x: float, y: float, level: int, weight: float, bitmap: F64, texels: F32, out: F32) -> None:
    """Add weight · colour at texel (x, y) of level 0, fetched from `level`, bilinear, edges repeated."""
    w, h, first = int(bitmap[1]), int(bitmap[2]), int(bitmap[3])
    step = 1.0
    for _ in range(level):
        if w == 1 and h == 1:
            break
        first += 3 * w * h
        w, h, step = (w + 1) // 2, (h + 1) // 2, step * 2.0
    x, y = min(max(x / step - 0.5, 0.0), w - 1.0), min(max(y / step - 0.5, 0.0), h - 1.0)
    j, i = int(x), int(y)
    fx, fy = x - j, y - i
    j1, i1 = min(j + 1, w - 1), min(i + 1, h - 1)
    for c in range(3):
        top = (1.0 - fx) * texels[first + 3 * (i * w + j) + c] + fx * texels[first + 3 * (i * w + j1) + c]
        low = (1.0 - fx) * texels[first + 3 * (i1 * w + j) + c] + fx * texels[first + 3 * (i1 * w + j1) + c]
        out[c] += np.float32(weight * ((1.0 - fy) * top + fy * low))


@inlined
def shade_bitmap(items: LookupItems, count: int, tables: MaterialTables) -> None:
    """Fill the values of all items of pictures with their colours, averaged over each footprint."""
    begin, end, obj, where = items.begin, items.end, items.obj, items.where
    du, dv, value = items.du, items.dv, items.value
    kind, bitmaps, texels = tables.kind, tables.cells, tables.texels
    colour = np.zeros(3, np.float32)
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
        low = int(level)
        part = level - low
        for i in range(begin[m], end[m]):
            colour[:] = np.float32(0.0)
            for step in range(2 * taps):
                at, share = tap(step >> 1, taps)
                x, y = u + (du[i] + at * au) * per_m, v + (dv[i] + at * av) * per_m
                up = step & 1
                _add(x, y, low + up, share * (part if up else 1.0 - part), bitmap, texels, colour)
            for c in range(3):
                value[c, i] = colour[c]
