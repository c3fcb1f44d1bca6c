"""The material lookups of a batch: spans of pixels with their position on the face and their footprint.

A run on a mesh may need two or three items, one for each axis along which its material is mapped; small
faces that continue each other share one. Arrays are unpacked from their tuples before the loops, as
unpacking costs more than a pixel does.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.jit import part
from foveacam_hardware.sim.render.batch import CAPACITY, PixelBatch
from foveacam_hardware.sim.render.materials import BITMAP, NOISE, PLAIN, MaterialTables
from foveacam_hardware.sim.render.setup import ObjectTable, VisibleFaces

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]
I32 = NDArray[np.int32]

U, V, JUX, JUY, JVX, JVY, FROM_U, FROM_V = range(8)
ALIKE = 0.08
"""Footprints that differ by less than this part share an item."""


class LookupItems(NamedTuple):
    """Working memory: item m covers begin[m]..end[m]; pixel i of the batch is at axis · CAPACITY + i."""

    begin: I32  # (3 · CAPACITY,)
    end: I32
    obj: I32
    side: I32
    face: I32  # of the first run; cells and bitmaps do not share items between faces
    where: F64  # (3 · CAPACITY, 8) u, v; metres of u per pixel along x, y; of v; u, v relative to the camera
    newest: I32  # (3,) newest item of each axis, −1 at first
    du: F32  # (3 · CAPACITY,) relative to the item's (u, v), metres (stretched as the material is)
    dv: F32
    value: F32  # (3, 3 · CAPACITY) noise of mean 0, or mean of cells, or red, green, blue
    texel: I32  # (3 · CAPACITY,) for fetch_long
    part_x: F32
    part_y: F32


@part
def new_items() -> LookupItems:
    """Allocate the working memory."""
    n = 3 * CAPACITY
    return LookupItems(
        np.zeros(n, np.int32),
        np.zeros(n, np.int32),
        np.zeros(n, np.int32),
        np.zeros(n, np.int32),
        np.zeros(n, np.int32),
        np.zeros((n, 8)),
        np.zeros(3, np.int32),
        np.zeros(n, np.float32),
        np.zeros(n, np.float32),
        np.zeros((3, n), np.float32),
        np.zeros(n, np.int32),
        np.zeros(n, np.float32),
        np.zeros(n, np.float32),
    )


@part
def _axes(blend: int, side: int) -> tuple[int, int]:
    """Return the range of axes along which a face is mapped."""
    return (0, 3) if blend else (side >> 1, (side >> 1) + 1)


@part
def _weighs(weights: F64, f: int, axis: int) -> bool:
    """Return whether a face shows the material that is mapped along an axis."""
    w0, w1, w2 = weights[f, axis, 0], weights[f, axis, 1], weights[f, axis, 2]
    found: bool = w0 != 0.0 or w1 != 0.0 or w2 != 0.0
    return found


@part
def _have_alike_footprints(where: F64, m: int, ux: float, uy: float, vx: float, vy: float) -> bool:
    gap = abs(ux - where[m, JUX]) + abs(uy - where[m, JUY])
    gap += abs(vx - where[m, JVX]) + abs(vy - where[m, JVY])
    alike: bool = gap < ALIKE * (abs(ux) + abs(uy) + abs(vx) + abs(vy))
    return alike


@part
def find_items(
    batch: PixelBatch,
    runs: int,
    prims: VisibleFaces,
    objects: ObjectTable,
    tables: MaterialTables,
    items: LookupItems,
) -> int:
    """List the items of all runs that show a textured face; return their number."""
    face, start, x, y, t = batch.face, batch.first, batch.x, batch.y, batch.t
    obj, sides, blends, weights, q = prims.obj, prims.side, prims.blend, prims.weights, prims.q
    A, o, kind, stretch = objects.A, objects.o, tables.kind, tables.stretch
    begin, end, item_obj, item_side, where = items.begin, items.end, items.obj, items.side, items.where
    du, dv, newest, item_face = items.du, items.dv, items.newest, items.face
    newest[:] = -1
    n = 0
    for k in range(runs):
        f = face[k]
        if f < 0 or kind[obj[f]] == PLAIN:
            continue
        j, blend = obj[f], blends[f]
        a, b = np.uintp(start[k]), np.uintp(start[k + 1])
        i = (a + b) >> np.uintp(1)
        first_axis, last_axis = _axes(blend, sides[f])
        for axis in range(first_axis, last_axis):
            if blend and not _weighs(weights, f, axis):
                continue
            side = 2 * axis + ((blend >> axis) & 1) if blend else sides[f]
            shift = np.uintp(axis * CAPACITY)
            iu, iv = (2 if axis == 0 else 0), (2 if axis == 1 else 1)
            su, sv = stretch[j, 0], stretch[j, 1]
            u0, u1, u2 = A[j, iu, 0] * su, A[j, iu, 1] * su, A[j, iu, 2] * su
            v0, v1, v2 = A[j, iv, 0] * sv, A[j, iv, 1] * sv, A[j, iv, 2] * sv
            u, v = (u0 * x[i] + u1 * y[i] + u2) * t[i], (v0 * x[i] + v1 * y[i] + v2) * t[i]
            ux, uy = t[i] * (u0 - q[f, 0] * u), t[i] * (u1 - q[f, 1] * u)
            vx, vy = t[i] * (v0 - q[f, 0] * v), t[i] * (v1 - q[f, 1] * v)
            m = newest[axis]
            alike = m >= 0 and end[m] == a + shift and item_obj[m] == j and item_side[m] == side
            alike = alike and (item_face[m] == f or kind[j] == NOISE)
            if alike:
                near = abs(x[a] - x[begin[m] - shift]) < CAPACITY
                alike = near and _have_alike_footprints(where, m, ux, uy, vx, vy)
            if not alike:
                m = n
                n += 1
                newest[axis], item_face[m] = m, f
                begin[m], item_obj[m], item_side[m] = a + shift, j, side
                where[m, U], where[m, V] = o[j, iu] * su + u, o[j, iv] * sv + v
                where[m, JUX], where[m, JUY], where[m, JVX], where[m, JVY] = ux, uy, vx, vy
                where[m, FROM_U], where[m, FROM_V] = u, v
            end[m] = b + shift
            u, v = where[m, FROM_U], where[m, FROM_V]
            for p in range(a, b):
                du[p + shift] = np.float32((u0 * x[p] + u1 * y[p] + u2) * t[p] - u)
                dv[p + shift] = np.float32((v0 * x[p] + v1 * y[p] + v2) * t[p] - v)
    return n


@part
def add_up(
    batch: PixelBatch, runs: int, prims: VisibleFaces, tables: MaterialTables, items: LookupItems
) -> None:
    """Fill each run's shade with the mean of its items, weighted by the face's normal along their axes.

    Noise keeps its contrast, as its axes are independent; a smooth curve maps it from mean 0 to 0..1 and
    leaves some contrast at both ends.
    """
    face, start, x, y, t = batch.face, batch.first, batch.x, batch.y, batch.t
    shade, sums, value = batch.shade, batch.weight, items.value
    obj, kinds, weights, blends, sides = prims.obj, tables.kind, prims.weights, prims.blend, prims.side
    zero, half, one = np.float32(0.0), np.float32(0.5), np.float32(1.0)
    for k in range(runs):
        f = face[k]
        if f < 0 or kinds[obj[f]] == PLAIN:
            continue
        kind = kinds[obj[f]]
        a, b = np.uintp(start[k]), np.uintp(start[k + 1])
        blended, shift = blends[f] != 0, np.uintp((sides[f] >> 1) * CAPACITY)
        for c in range(3 if kind == BITMAP else 1):
            for i in range(a, b):
                sums[i] = zero if blended else one
                shade[c, i] = zero if blended else value[c, i + shift]
            for axis in range(3 if blended else 0):
                w0, w1, w2 = weights[f, axis, 0], weights[f, axis, 1], weights[f, axis, 2]
                for i in range(a, b):
                    w = max(zero, np.float32((w0 * x[i] + w1 * y[i] + w2) * t[i]))
                    sums[i] += w * w if kind == NOISE else w
                    shade[c, i] += w * value[c, i + np.uintp(axis * CAPACITY)]
            for i in range(a, b):
                shade[c, i] /= np.sqrt(sums[i]) if kind == NOISE else sums[i]
        for i in range(a, b if kind == NOISE else a):
            s = shade[0, i] + shade[0, i]
            shade[0, i] = half + half * s / np.sqrt(one + s * s)
