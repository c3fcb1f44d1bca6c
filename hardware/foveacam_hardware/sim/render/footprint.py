"""How a material is averaged over the footprint of a pixel: a stretched one by several taps along it."""

import numpy as np

from foveacam_hardware.jit import kernel

MAX_TAPS, MESH_TAPS = 8, 4
"""Most taps on a flat face, and on a smooth mesh, whose footprints are stretched at its outline only."""
TAP_SPREAD = 2.2
"""Base of the triangle of weights over the taps, in pixels."""
TAP_STEP = 1.5
"""Distance of the taps, in widths of a tap: half the wavelength that a tap lets through (CUT_PX)."""
ROUND = 1.15
"""A footprint this much longer than wide is taken as round."""


@kernel
def footprint_filter(
    ux: float, uy: float, vx: float, vy: float, most: int
) -> tuple[float, float, int, float, float]:
    """Return how to average over the footprint of a pixel, metres.

    Its long axis (u, v); the number of taps along it, `most` at most; the widths that one tap, and all
    together, leave.
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


@kernel
def tap(k: int, taps: int) -> tuple[float, float]:
    """Return where tap k lies along the long axis, in pixels, and its weight, of a triangle with sum 1."""
    at = (k + 0.5) / taps - 0.5
    total = 0.5 * taps if taps % 2 == 0 else 0.5 * (taps * taps + 1) / taps
    return at * TAP_SPREAD, (1.0 - 2.0 * abs(at)) / total
