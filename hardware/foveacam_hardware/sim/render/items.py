"""What of a batch has to be looked up in a material: for each run its coordinates on the face, and footprint.

A run on a mesh may need two or three items, one for each axis along which its material is mapped. All
arrays are taken out of their tuples before the loops: taking them out costs more than a pixel does.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.sim.render.batch import CAPACITY, Batch
from foveacam_hardware.sim.render.jit import inlined, kernel
from foveacam_hardware.sim.render.materials import BITMAP, NOISE, PLAIN, Tables
from foveacam_hardware.sim.render.setup import Objects, Prims

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]
I32 = NDArray[np.int32]

U, V, JUX, JUY, JVX, JVY = range(6)


class Items(NamedTuple):
    """Working memory: item m covers values first[m]..first[m + 1]."""

    of_run: I32  # (CAPACITY + 1,) first item of each run
    first: I32  # (3 · CAPACITY + 1,)
    obj: I32  # (3 · CAPACITY,)
    side: I32
    where: F64  # (3 · CAPACITY, 6) u, v in the middle; metres of u per pixel along x, y; then of v
    du: F32  # (3 · CAPACITY,) from the middle, metres (as the material stretches them)
    dv: F32
    value: F32  # (3, 3 · CAPACITY) noise of mean 0, or mean of cells, or red, green, blue


@kernel
def new_items() -> Items:
    """Allocate the working memory."""
    n = 3 * CAPACITY
    return Items(
        np.zeros(CAPACITY + 1, np.int32),
        np.zeros(n + 1, np.int32),
        np.zeros(n, np.int32),
        np.zeros(n, np.int32),
        np.zeros((n, 6)),
        np.zeros(n, np.float32),
        np.zeros(n, np.float32),
        np.zeros((3, n), np.float32),
    )


@inlined
def find_items(batch: Batch, runs: int, prims: Prims, objects: Objects, tables: Tables, items: Items) -> int:
    """List the items of all runs that see a textured face; return how many."""
    face, start, x, y, t = batch.face, batch.first, batch.x, batch.y, batch.t
    obj, sides, blends, weights, q = prims.obj, prims.side, prims.blend, prims.weights, prims.q
    A, o, kind, stretch = objects.A, objects.o, tables.kind, tables.stretch
    of_run, first, item_obj, item_side = items.of_run, items.first, items.obj, items.side
    where, du, dv = items.where, items.du, items.dv
    n, p = 0, np.uintp(0)
    for k in range(runs):
        of_run[k] = n
        f = face[k]
        if f < 0 or kind[obj[f]] == PLAIN:
            continue
        j, blend = obj[f], blends[f]
        a, b = np.uintp(start[k]), np.uintp(start[k + 1])
        m = (a + b) >> np.uintp(1)
        for turn in range(3 if blend else 1):
            side = 2 * turn + ((blend >> turn) & 1) if blend else sides[f]
            if (
                blend
                and weights[f, turn, 0] == 0.0
                and weights[f, turn, 1] == 0.0
                and weights[f, turn, 2] == 0.0
            ):
                continue
            iu, iv = (2 if side < 2 else 0), (2 if side >> 1 == 1 else 1)
            su, sv = stretch[j, 0], stretch[j, 1]
            u0, u1, u2 = A[j, iu, 0] * su, A[j, iu, 1] * su, A[j, iu, 2] * su
            v0, v1, v2 = A[j, iv, 0] * sv, A[j, iv, 1] * sv, A[j, iv, 2] * sv
            u, v = (u0 * x[m] + u1 * y[m] + u2) * t[m], (v0 * x[m] + v1 * y[m] + v2) * t[m]
            where[n, U], where[n, V] = o[j, iu] * su + u, o[j, iv] * sv + v
            where[n, JUX], where[n, JUY] = t[m] * (u0 - q[f, 0] * u), t[m] * (u1 - q[f, 1] * u)
            where[n, JVX], where[n, JVY] = t[m] * (v0 - q[f, 0] * v), t[m] * (v1 - q[f, 1] * v)
            item_obj[n], item_side[n], first[n] = j, side, p
            shift = p - a
            for i in range(a, b):
                du[i + shift] = np.float32((u0 * x[i] + u1 * y[i] + u2) * t[i] - u)
                dv[i + shift] = np.float32((v0 * x[i] + v1 * y[i] + v2) * t[i] - v)
            p += b - a
            n += 1
    of_run[runs] = n
    first[n] = p
    return n


@inlined
def add_up(batch: Batch, runs: int, prims: Prims, tables: Tables, items: Items) -> None:
    """Fill each run's shade from its items: their mean by how far the face looks along their axes.

    Noise keeps its contrast, for its axes are independent; it is brought from mean 0 to 0..1 by a smooth
    curve that leaves some contrast at both ends.
    """
    face, start, x, y, t, shade, sums = (
        batch.face,
        batch.first,
        batch.x,
        batch.y,
        batch.t,
        batch.shade,
        batch.weight,
    )
    obj, kinds, weights = prims.obj, tables.kind, prims.weights
    of_run, first, sides, value = items.of_run, items.first, items.side, items.value
    zero, half, one = np.float32(0.0), np.float32(0.5), np.float32(1.0)
    for k in range(runs):
        f = face[k]
        if f < 0:
            continue
        kind = kinds[obj[f]]
        a, b = np.uintp(start[k]), np.uintp(start[k + 1])
        rows = 3 if kind == BITMAP else 1
        single = of_run[k + 1] - of_run[k] == 1
        for i in range(a, b):
            sums[i] = one if single else zero
            for c in range(rows):
                shade[c, i] = value[c, i - a + np.uintp(first[of_run[k]])] if single else zero
        for m in range(of_run[k], of_run[k] if single else of_run[k + 1]):
            shift, axis = np.uintp(first[m]) - a, sides[m] >> 1
            w0, w1, w2 = weights[f, axis, 0], weights[f, axis, 1], weights[f, axis, 2]
            for i in range(a, b):
                w = max(zero, np.float32((w0 * x[i] + w1 * y[i] + w2) * t[i]))
                sums[i] += w * w if kind == NOISE else w
                for c in range(rows):
                    shade[c, i] += w * value[c, i + shift]
        if kind == NOISE:
            for i in range(a, b):
                s = (shade[0, i] + shade[0, i]) / np.sqrt(sums[i])
                shade[0, i] = half + half * s / np.sqrt(one + s * s)
        elif kind != PLAIN and not single:
            for i in range(a, b):
                for c in range(rows):
                    shade[c, i] /= sums[i]
