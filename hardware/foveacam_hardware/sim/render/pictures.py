"""Picture materials: a user's bitmap, filtered between mip levels with several fetches along its footprint."""

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.sim.render.jit import kernel

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]

MAX_TAPS = 8


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


@kernel
def shade_bitmap(du: F32, dv: F32, u: float, v: float, J: F64, bitmap: F64, texels: F32, out: F32) -> None:
    """Fill out (3, n) with the picture's colours over each footprint."""
    texel_m = bitmap[0]
    p, q = np.hypot(J[0, 0], J[1, 0]), np.hypot(J[0, 1], J[1, 1])
    long, k = (p, 0) if p >= q else (q, 1)
    short = abs(J[0, 0] * J[1, 1] - J[0, 1] * J[1, 0]) / max(long, 1e-300)
    taps = int(min(float(MAX_TAPS), max(1.0, np.ceil(long / max(short, 1e-300) - 0.3))))
    level = max(0.0, np.log2(max(short, long / taps) / texel_m))
    low = int(level)
    part = level - low
    colour = np.zeros(3, np.float32)
    for i in range(du.shape[0]):
        colour[:] = np.float32(0.0)
        for tap in range(taps):
            at = (tap + 0.5) / taps - 0.5
            x = (u + du[i] + at * J[0, k]) / texel_m + 0.5 * bitmap[1]
            y = (v + dv[i] + at * J[1, k]) / texel_m + 0.5 * bitmap[2]
            _add(x, y, low, (1.0 - part) / taps, bitmap, texels, colour)
            if part > 0.0:
                _add(x, y, low + 1, part / taps, bitmap, texels, colour)
        for c in range(3):
            out[c, i] = colour[c]
