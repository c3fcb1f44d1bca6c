"""Batches of pixel runs: each run shows one face, and a batch is shaded in one pass.

They are gathered from a tile or from its edge samples. A kernel call per run would cost more than the
computation; these kernels are called once per tile.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.jit import part
from foveacam_hardware.sim.render.setup import TILE_H, TILE_W

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]
I32 = NDArray[np.int32]

CAPACITY = TILE_W * TILE_H


class PixelBatch(NamedTuple):
    """Working memory: pixels 0..first[runs]; run k is first[k]..first[k + 1] and shows face[k]."""

    first: I32  # (CAPACITY + 1,)
    face: I32  # (CAPACITY,) row in VisibleFaces, −1 = sky
    x: F64  # (CAPACITY,) undistorted pixel
    y: F64
    t: F64  # ray parameter
    light: F32
    shade: F32  # (3, CAPACITY) row 0: 0 = first colour, 1 = second; red, green, blue of a bitmap
    weight: F32  # sum over mapping axes, of the weights or, for noise, of their squares


@part
def new_batch() -> PixelBatch:
    """Allocate the working memory."""
    n = CAPACITY
    return PixelBatch(
        np.zeros(n + 1, np.int32),
        np.zeros(n, np.int32),
        np.zeros(n),
        np.zeros(n),
        np.zeros(n),
        np.zeros(n, np.float32),
        np.zeros((3, n), np.float32),
        np.zeros(n, np.float32),
    )


@part
def gather(x: F64, y: F64, face: I32, width: int, height: int, batch: PixelBatch) -> int:
    """Fill the batch row by row from a tile without its border; return the number of runs."""
    first, faces, to_x, to_y = batch.first, batch.face, batch.x, batch.y
    runs, n = 0, np.uintp(0)
    for r in range(1, height + 1):
        before = np.int32(-2)
        for c in range(np.uintp(1), np.uintp(width + 1)):
            f = face[r, c]
            if f != before:
                first[runs] = n
                faces[runs] = f
                runs += 1
                before = f
            to_x[n] = x[r, c]
            to_y[n] = y[r, c]
            n += np.uintp(1)
    first[runs] = n
    return runs


@part
def interpolate(batch: PixelBatch, runs: int, q: F64, light: F64) -> None:
    """Fill the ray parameters and the light of all runs that show a face."""
    face, first, x, y, t, lit = batch.face, batch.first, batch.x, batch.y, batch.t, batch.light
    for k in range(runs):
        f = face[k]
        if f < 0:
            continue
        q0, q1, q2 = q[f, 0], q[f, 1], q[f, 2]
        l0, l1, l2 = light[f, 0], light[f, 1], light[f, 2]
        for i in range(np.uintp(first[k]), np.uintp(first[k + 1])):
            along = 1.0 / (q0 * x[i] + q1 * y[i] + q2)
            t[i] = along
            lit[i] = np.float32((l0 * x[i] + l1 * y[i] + l2) * along)


@part
def shade_sky(batch: PixelBatch, runs: int, Minv: F64) -> None:
    """Fill the shade of all runs that show no face: 0 at the horizon, 1 from 40° up."""
    face, first, x, y, shade = batch.face, batch.first, batch.x, batch.y, batch.shade
    for k in range(runs):
        if face[k] >= 0:
            continue
        for i in range(np.uintp(first[k]), np.uintp(first[k + 1])):
            dx = Minv[0, 0] * x[i] + Minv[0, 1] * y[i] + Minv[0, 2]
            dy = Minv[1, 0] * x[i] + Minv[1, 1] * y[i] + Minv[1, 2]
            dz = Minv[2, 0] * x[i] + Minv[2, 1] * y[i] + Minv[2, 2]
            up = -1.55 * dy / np.sqrt(dx * dx + dy * dy + dz * dz)
            shade[0, i] = np.float32(min(1.0, max(0.0, up)))
