"""Once a frame: project the scene, keep the faces that may be seen, and sort them into tiles.

A face is a convex polygon of 3 or 4 edges kept in homogeneous pixel coordinates p = (x, y, 1): inside where
all four edge functions E·p are not negative, 1/t = q·p where t scales the ray M⁻¹p. Nothing is clipped.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.sim.render.jit import kernel
from foveacam_hardware.sim.render.scene import Geometry

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]
I32 = NDArray[np.int32]

TILE_W, TILE_H = 64, 32
"""Pixels of a tile; tiles lie at absolute multiples of these, whatever part of an image is asked for."""
BLEND_FROM = 0.8
"""A mesh is mapped along every axis whose normal component exceeds this part of the greatest."""


class View(NamedTuple):
    """A projection as the kernels see it."""

    M: F64  # (3, 3)
    Minv: F64  # (3, 3)
    C: F64  # (3,)
    depth: F64  # (3,) depth per ray parameter t at p: depth·p
    q_max: float  # 1/t at the near plane
    width: int
    height: int
    shift: F32  # (h, w, 2) undistorted minus image pixel, or (1, 1, 2) without a lens table
    tile_shift: (
        F64  # (tiles, 4) least and greatest shift in x, then y, within each tile and a pixel around it
    )


class Objects(NamedTuple):
    """What every face of an object shares."""

    A: F64  # (n, 3, 3) ray directions in object coordinates: A p
    o: F64  # (n, 3) camera centre in object coordinates
    lamp: F64  # (n, 3) direction to the lamp in object coordinates
    P: F64  # (n, 3, 3) homogeneous pixels from object coordinates: P X + b
    b: F64  # (n, 3)


class Prims(NamedTuple):
    """The faces in view, in the order of the scene; the first `count` rows are filled."""

    edges: F64  # (f, 4, 3)
    q: F64  # (f, 3)
    light: F64  # (f, 3) light/t
    weights: F64  # (f, 3, 3) weight/t of each mapping axis, where blended
    blend: I32  # (f,) 0, or 8 + a bit for each axis whose normal component is positive
    side: I32  # (f,)
    obj: I32  # (f,)
    box: F64  # (f, 4) least and greatest undistorted x, then y


class Bins(NamedTuple):
    """Faces of each tile: items[start[i]:start[i + 1]], ascending."""

    start: NDArray[np.int64]
    items: I32


def empty_prims(faces: int) -> Prims:
    """Return room for `faces` faces."""
    n = max(faces, 1)
    return Prims(
        np.empty((n, 4, 3)),
        np.empty((n, 3)),
        np.empty((n, 3)),
        np.empty((n, 3, 3)),
        np.empty(n, np.int32),
        np.empty(n, np.int32),
        np.empty(n, np.int32),
        np.empty((n, 4)),
    )


@kernel
def _lambert(nx: float, ny: float, nz: float, lamp: F64, ambient: float) -> float:
    return ambient + (1.0 - ambient) * max(0.0, nx * lamp[0] + ny * lamp[1] + nz * lamp[2])


@kernel
def _project_vertices(first: int, last: int, geometry: Geometry, A: F64, b: F64, p: F64) -> None:
    for v in range(first, last):
        x, y, z = geometry.vertices[v, 0], geometry.vertices[v, 1], geometry.vertices[v, 2]
        for k in range(3):
            p[v, k] = A[k, 0] * x + A[k, 1] * y + A[k, 2] * z + b[k]


@kernel
def _axis_weights(nx: float, ny: float, nz: float, w: F64) -> None:
    """Fill w (3,) with the share of each mapping axis at a normal; they add up to 1."""
    ax, ay, az = abs(nx), abs(ny), abs(nz)
    floor = BLEND_FROM * max(ax, ay, az)
    w[0], w[1], w[2] = max(0.0, ax - floor), max(0.0, ay - floor), max(0.0, az - floor)
    total = w[0] + w[1] + w[2]
    if total > 0.0:
        for k in range(3):
            w[k] /= total


@kernel
def _bounds(corners: F64, count: int, w_near: float, box: F64) -> bool:
    """Fill box with the extent of the part of a polygon beyond the near plane; false when there is none."""
    box[0] = box[2] = 1e18
    box[1] = box[3] = -1e18
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        wi, wj = corners[i, 2], corners[j, 2]
        if wi >= w_near:
            x, y = corners[i, 0] / wi, corners[i, 1] / wi
            box[0], box[1] = min(box[0], x), max(box[1], x)
            box[2], box[3] = min(box[2], y), max(box[3], y)
        if (wi >= w_near) != (wj >= w_near):
            s = (w_near - wi) / (wj - wi)
            x = (corners[i, 0] + s * (corners[j, 0] - corners[i, 0])) / w_near
            y = (corners[i, 1] + s * (corners[j, 1] - corners[i, 1])) / w_near
            box[0], box[1] = min(box[0], x), max(box[1], x)
            box[2], box[3] = min(box[2], y), max(box[3], y)
    return box[0] <= box[1]


@kernel
def _cross(a: F64, b: F64, scale: float, out: F64) -> None:
    out[0] = (a[1] * b[2] - a[2] * b[1]) * scale
    out[1] = (a[2] * b[0] - a[0] * b[2]) * scale
    out[2] = (a[0] * b[1] - a[1] * b[0]) * scale


@kernel
def _edges(corners: F64, count: int, out: F64) -> float:
    """Fill out (4, 3) with edge functions, positive inside; return the determinant of the first three corners."""
    for i in range(count):
        _cross(corners[i], corners[i + 1 if i + 1 < count else 0], 1.0, out[i])
    det = corners[2, 0] * out[0, 0] + corners[2, 1] * out[0, 1] + corners[2, 2] * out[0, 2]
    if det < 0.0:
        for i in range(count):
            for k in range(3):
                out[i, k] = -out[i, k]
    if count == 3:
        out[3, 0] = out[3, 1] = 0.0
        out[3, 2] = 1.0
    return abs(det)


@kernel
def _interpolant(edges: F64, det: float, a: float, b: float, c: float, out: F64) -> None:
    """Fill out (3,) so that t·(out·p) runs through a, b, c at a triangle's corners."""
    for k in range(3):
        out[k] = (a * edges[1, k] + b * edges[2, k] + c * edges[0, k]) / det


@kernel
def _smooth_face(
    n: int, f: int, det: float, geometry: Geometry, lamp: F64, ambient: float, prims: Prims
) -> None:
    """Interpolate light and mapping weights of a mesh's triangle between its corners' normals."""
    light, w = np.empty(3), np.empty((3, 3))
    for i in range(3):
        normal = geometry.normals[geometry.faces[f, i]]
        light[i] = _lambert(normal[0], normal[1], normal[2], lamp, ambient)
        _axis_weights(normal[0], normal[1], normal[2], w[i])
    edges = prims.edges[n]
    _interpolant(edges, det, light[0], light[1], light[2], prims.light[n])
    axis = geometry.side[f] >> 1
    only = w[0, axis] + w[1, axis] + w[2, axis] >= 3.0 - 1e-9
    prims.blend[n] = 0
    if not only:
        bits = 8
        for k in range(3):
            _interpolant(edges, det, w[0, k], w[1, k], w[2, k], prims.weights[n, k])
            if geometry.face_normals[f, k] > 0.0:
                bits |= 1 << k
        prims.blend[n] = bits


@kernel
def _flat_face(n: int, normal: F64, facing: float, lamp: F64, ambient: float, prims: Prims) -> None:
    """Give a flat face one light; a face seen from behind is lit from there."""
    s = 1.0 if facing >= 0.0 else -1.0
    light = _lambert(s * normal[0], s * normal[1], s * normal[2], lamp, ambient)
    for k in range(3):
        prims.light[n, k] = light * prims.q[n, k]
    prims.blend[n] = 0


@kernel
def _facing(f: int, o: F64, geometry: Geometry) -> float:
    """Return how far the camera is above the plane of a face, metres."""
    normal, v0 = geometry.face_normals[f], geometry.vertices[geometry.faces[f, 0]]
    return normal[0] * (o[0] - v0[0]) + normal[1] * (o[1] - v0[1]) + normal[2] * (o[2] - v0[2])


@kernel
def _place_face(
    n: int,
    f: int,
    j: int,
    facing: float,
    p: F64,
    geometry: Geometry,
    objects: Objects,
    view: View,
    prims: Prims,
) -> float:
    """Fill box, plane and edges of a face; return its determinant, 0 when it cannot be seen."""
    if facing == 0.0 or (geometry.closed[j] and facing < 0.0):
        return 0.0
    count = 4 if geometry.faces[f, 3] >= 0 else 3
    corners = np.empty((4, 3))
    for i in range(count):
        corners[i] = p[geometry.faces[f, i]]
    box = prims.box[n]
    if not _bounds(corners, count, 1.0 / view.q_max, box):
        return 0.0
    span = view.tile_shift[-1]
    if box[1] < span[0] - 1.0 or box[0] > view.width + span[1]:
        return 0.0
    if box[3] < span[2] - 1.0 or box[2] > view.height + span[3]:
        return 0.0
    normal = geometry.face_normals[f]
    for k in range(3):
        along = (
            normal[0] * objects.A[j, 0, k] + normal[1] * objects.A[j, 1, k] + normal[2] * objects.A[j, 2, k]
        )
        prims.q[n, k] = -along / facing
    return _edges(corners, count, prims.edges[n])


@kernel
def set_up(geometry: Geometry, objects: Objects, ambient: float, view: View, prims: Prims) -> int:
    """Fill prims for a view; return how many faces may be seen."""
    n = 0
    p = np.empty((geometry.vertices.shape[0], 3))
    for j in range(objects.o.shape[0]):
        first, last = geometry.first_vertex[j], geometry.first_vertex[j + 1]
        _project_vertices(first, last, geometry, objects.P[j], objects.b[j], p)
        for f in range(geometry.first_face[j], geometry.first_face[j + 1]):
            facing = _facing(f, objects.o[j], geometry)
            det = _place_face(n, f, j, facing, p, geometry, objects, view, prims)
            if det == 0.0:
                continue
            if geometry.smooth[j]:
                _smooth_face(n, f, det, geometry, objects.lamp[j], ambient, prims)
            else:
                _flat_face(n, geometry.face_normals[f], facing, objects.lamp[j], ambient, prims)
            prims.side[n] = geometry.side[f]
            prims.obj[n] = j
            n += 1
    return n


@kernel
def _outside(edges: F64, x0: float, x1: float, y0: float, y1: float) -> bool:
    """Whether a rectangle lies wholly outside one of four edges."""
    for i in range(4):
        a, b, c = edges[i, 0], edges[i, 1], edges[i, 2]
        if max(a * x0, a * x1) + max(b * y0, b * y1) + c < 0.0:
            return True
    return False


@kernel
def _visit(prims: Prims, count: int, view: View, bins: Bins, footprint: NDArray[np.bool_]) -> None:
    """Count the faces of each tile into start[tile + 1], or, where there is room for them, file them at start[tile]."""
    fill = bins.items.shape[0] > 0
    columns = (view.width + TILE_W - 1) // TILE_W
    rows = (view.height + TILE_H - 1) // TILE_H
    span = view.tile_shift[-1]
    for n in range(count):
        box = prims.box[n]
        c0 = int(max(0.0, np.floor((box[0] - span[1] - 2.0) / TILE_W)))
        c1 = int(min(columns - 1.0, np.floor((box[1] - span[0] + 2.0) / TILE_W)))
        r0 = int(max(0.0, np.floor((box[2] - span[3] - 2.0) / TILE_H)))
        r1 = int(min(rows - 1.0, np.floor((box[3] - span[2] + 2.0) / TILE_H)))
        exact = (c1 - c0 + 1) * (r1 - r0 + 1) > 8
        for r in range(r0, r1 + 1):
            for c in range(c0, c1 + 1):
                tile = r * columns + c
                s = view.tile_shift[tile]
                x0, x1 = c * TILE_W - 1.0 + s[0], (c + 1) * TILE_W + s[1]
                y0, y1 = r * TILE_H - 1.0 + s[2], (r + 1) * TILE_H + s[3]
                if box[0] > x1 or box[1] < x0 or box[2] > y1 or box[3] < y0:
                    continue
                if exact and _outside(prims.edges[n], x0, x1, y0, y1):
                    continue
                if fill:
                    bins.items[bins.start[tile]] = n
                    bins.start[tile] += 1
                else:
                    bins.start[tile + 1] += 1
                    footprint[prims.obj[n], tile] = True


@kernel
def sort_into_tiles(prims: Prims, count: int, view: View, footprint: NDArray[np.bool_]) -> Bins:
    """Return the faces of each tile; footprint (objects, tiles) is filled with where each object may be seen."""
    tiles = footprint.shape[1]
    start = np.zeros(tiles + 1, np.int64)
    empty = Bins(start, np.empty(0, np.int32))
    _visit(prims, count, view, empty, footprint)
    for tile in range(tiles):
        start[tile + 1] += start[tile]
    bins = Bins(start, np.empty(start[tiles], np.int32))
    _visit(prims, count, view, bins, footprint)
    for tile in range(tiles, 0, -1):
        start[tile] = start[tile - 1]
    start[0] = 0
    return bins


@kernel
def tile_shifts(shift: F32, width: int, height: int) -> F64:
    """Return (tiles + 1, 4) least and greatest shift in x, then y, of each tile and a pixel around; last: of all."""
    columns = (width + TILE_W - 1) // TILE_W
    rows = (height + TILE_H - 1) // TILE_H
    out = np.zeros((columns * rows + 1, 4))
    if shift.shape[0] == 1:
        return out
    for r in range(rows):
        for c in range(columns):
            x0, x1 = max(0, c * TILE_W - 1), min(width, (c + 1) * TILE_W + 1)
            y0, y1 = max(0, r * TILE_H - 1), min(height, (r + 1) * TILE_H + 1)
            tile = r * columns + c
            for k in range(2):
                part = shift[y0:y1, x0:x1, k]
                out[tile, 2 * k] = part.min()
                out[tile, 2 * k + 1] = part.max()
    for k in range(4):
        out[-1, k] = out[:-1, k].min() if k % 2 == 0 else out[:-1, k].max()
    return out
