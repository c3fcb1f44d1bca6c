"""How a material is averaged over the footprint of a pixel: a stretched one by several taps along it."""

import numpy as np

from foveacam_hardware.sim.render.jit import kernel

MAX_TAPS = 8
TAP_STEP = 1.3
"""Distance of the taps along a stretched footprint, in units of its width: half of what a tap lets through."""


@kernel
def footprint_filter(ux: float, uy: float, vx: float, vy: float) -> tuple[float, float, int, float, float]:
    """Return how to average over a footprint: its long axis (u, v), the number of taps, the widths that
    one tap and that all of them together leave, metres.
    """
    p, r, s = ux * ux + uy * uy, vx * vx + vy * vy, ux * vx + uy * vy
    d = 0.5 * (p - r)
    spread = np.sqrt(d * d + s * s)
    long = max(np.sqrt(0.5 * (p + r) + spread), 1e-300)
    short = abs(ux * vy - uy * vx) / long
    # Half the angle of (d, s) by its tangent: (spread + d, s) or, where that vanishes, (s, spread − d).
    a, b = (spread + d, s) if d >= 0.0 else (s, spread - d)
    norm = np.sqrt(a * a + b * b)
    along_u, along_v = (long * a / norm, long * b / norm) if norm > 0.0 else (long, 0.0)
    taps = int(min(float(MAX_TAPS), max(1.0, np.ceil(long / (TAP_STEP * max(short, 1e-300))))))
    return along_u, along_v, taps, max(short, long / (TAP_STEP * taps)), long
