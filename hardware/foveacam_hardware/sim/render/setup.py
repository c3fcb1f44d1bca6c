"""Set-up of a frame: project the scene and collect the faces that may be visible.

A face is a convex polygon of 3 or 4 edges kept in homogeneous pixel coordinates p = (x, y, 1): inside where
all four edge functions E·p are not negative, 1/t = q·p where t scales the ray M⁻¹p. Nothing is clipped.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.jit import kernel, part
from foveacam_hardware.sim.render.scene import SceneGeometry

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]
I32 = NDArray[np.int32]

TILE_W, TILE_H = 64, 32
"""Size of a tile, px; tiles lie at absolute multiples of it, whatever region is requested."""
BLEND_FROM = 0.8
"""A mesh is mapped along every axis whose normal component exceeds this part of the greatest."""


class KernelView(NamedTuple):
    """A projection in the form that the kernels use."""

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


class ObjectTable(NamedTuple):
    """Transforms per object, shared by its faces."""

    A: F64  # (n, 3, 3) ray directions in object coordinates: A p
    o: F64  # (n, 3) camera centre in object coordinates
    lamp: F64  # (n, 3) direction to the lamp in object coordinates
    P: F64  # (n, 3, 3) homogeneous pixels from object coordinates: P X + b
    b: F64  # (n, 3)


class VisibleFaces(NamedTuple):
    """The faces in view, in the order of the scene; the first `count` rows are filled."""

    edges: F64  # (f, 4, 3)
    q: F64  # (f, 3)
    light: F64  # (f, 3) light/t
    weights: F64  # (f, 3, 3) weight/t of each mapping axis, where blended
    blend: I32  # (f,) 0, or 8 + a bit for each axis whose normal component is positive
    side: I32  # (f,)
    obj: I32  # (f,)
    face: I32  # (f,) row in SceneGeometry
    box: F64  # (f, 4) least and greatest undistorted x, then y


def empty_prims(faces: int) -> VisibleFaces:
    """Allocate arrays for `faces` faces."""
    n = max(faces, 1)
    return VisibleFaces(
        np.empty((n, 4, 3)),
        np.empty((n, 3)),
        np.empty((n, 3)),
        np.empty((n, 3, 3)),
        np.empty(n, np.int32),
        np.empty(n, np.int32),
        np.empty(n, np.int32),
        np.empty(n, np.int32),
        np.empty((n, 4)),
    )


class ProjectedVertices(NamedTuple):
    """The vertices of the scene in a view."""

    p: F64  # (v, 3) homogeneous pixel
    light: F64  # (v,)
    weights: F64  # (v, 3) share of each mapping axis


def empty_corners(vertices: int) -> ProjectedVertices:
    """Allocate arrays for `vertices` vertices."""
    return ProjectedVertices(np.empty((vertices, 3)), np.empty(vertices), np.empty((vertices, 3)))


@part
def _in_view(corners: F64, P: F64, b: F64, view: KernelView) -> bool:
    """Return whether a box, given by its corners (8, 3) in object coordinates, may be in the image."""
    span = view.tile_shift[-1]
    x0, x1 = span[0] - 1.0, view.width + span[1]
    y0, y1 = span[2] - 1.0, view.height + span[3]
    left = right = above = below = behind = True
    for i in range(8):
        x, y, z = corners[i, 0], corners[i, 1], corners[i, 2]
        px = P[0, 0] * x + P[0, 1] * y + P[0, 2] * z + b[0]
        py = P[1, 0] * x + P[1, 1] * y + P[1, 2] * z + b[1]
        w = P[2, 0] * x + P[2, 1] * y + P[2, 2] * z + b[2]
        left, right = left and px < x0 * w, right and px > x1 * w
        above, below = above and py < y0 * w, below and py > y1 * w
        behind = behind and w * view.q_max < 1.0
    return not (left or right or above or below or behind)


@part
def _transform(
    geometry: SceneGeometry,
    objects: ObjectTable,
    ambient: float,
    view: KernelView,
    corners: ProjectedVertices,
) -> NDArray[np.bool_]:
    """Fill the corners of all objects that may be in view; return a mask of these objects."""
    vertices, normals, first, smooth = (
        geometry.vertices,
        geometry.normals,
        geometry.first_vertex,
        geometry.smooth,
    )
    pixels, light, weights = corners.p, corners.light, corners.weights
    in_view = np.zeros(objects.o.shape[0], np.bool_)
    for j in range(in_view.shape[0]):
        in_view[j] = _in_view(geometry.bounds[j], objects.P[j], objects.b[j], view)
        if not in_view[j]:
            continue
        P, b, lamp = objects.P[j], objects.b[j], objects.lamp[j]
        for v in range(first[j], first[j + 1]):
            x, y, z = vertices[v, 0], vertices[v, 1], vertices[v, 2]
            for k in range(3):
                pixels[v, k] = P[k, 0] * x + P[k, 1] * y + P[k, 2] * z + b[k]
        for v in range(first[j], first[j + 1] if smooth[j] else first[j]):
            nx, ny, nz = normals[v, 0], normals[v, 1], normals[v, 2]
            light[v] = ambient + (1.0 - ambient) * max(0.0, nx * lamp[0] + ny * lamp[1] + nz * lamp[2])
            ax, ay, az = abs(nx), abs(ny), abs(nz)
            floor = BLEND_FROM * max(ax, ay, az)
            ax, ay, az = max(0.0, ax - floor), max(0.0, ay - floor), max(0.0, az - floor)
            total = max(ax + ay + az, 1e-300)
            weights[v, 0], weights[v, 1], weights[v, 2] = ax / total, ay / total, az / total
    return in_view


@part
def _bounds(p: F64, faces: I32, f: int, w_near: float) -> tuple[float, float, float, float]:
    """Return least and greatest x, then y, of a face beyond the near plane; an empty range when none is."""
    x0 = y0 = 1e18
    x1 = y1 = -1e18
    count = 4 if faces[f, 3] >= 0 else 3
    for i in range(count):
        a, b = faces[f, i], faces[f, i + 1 if i + 1 < count else 0]
        wa, wb = p[a, 2], p[b, 2]
        if wa >= w_near:
            x, y = p[a, 0] / wa, p[a, 1] / wa
            x0, x1, y0, y1 = min(x0, x), max(x1, x), min(y0, y), max(y1, y)
        if (wa >= w_near) != (wb >= w_near):
            s = (w_near - wa) / (wb - wa)
            x, y = (p[a, 0] + s * (p[b, 0] - p[a, 0])) / w_near, (p[a, 1] + s * (p[b, 1] - p[a, 1])) / w_near
            x0, x1, y0, y1 = min(x0, x), max(x1, x), min(y0, y), max(y1, y)
    return x0, x1, y0, y1


@part
def _edges(p: F64, faces: I32, f: int, out: F64, n: int) -> float:
    """Fill out[n] (4, 3) with edge functions, positive inside; return the determinant of three corners."""
    count = 4 if faces[f, 3] >= 0 else 3
    out[n, 3, 0] = out[n, 3, 1] = 0.0
    out[n, 3, 2] = 1.0
    for i in range(count):
        a, b = faces[f, i], faces[f, i + 1 if i + 1 < count else 0]
        out[n, i, 0] = p[a, 1] * p[b, 2] - p[a, 2] * p[b, 1]
        out[n, i, 1] = p[a, 2] * p[b, 0] - p[a, 0] * p[b, 2]
        out[n, i, 2] = p[a, 0] * p[b, 1] - p[a, 1] * p[b, 0]
    c = faces[f, 2]
    det = p[c, 0] * out[n, 0, 0] + p[c, 1] * out[n, 0, 1] + p[c, 2] * out[n, 0, 2]
    if det < 0.0:
        for i in range(count):
            for k in range(3):
                out[n, i, k] = -out[n, i, k]
    return float(abs(det))


@part
def _place(
    geometry: SceneGeometry,
    objects: ObjectTable,
    in_view: NDArray[np.bool_],
    view: KernelView,
    p: F64,
    prims: VisibleFaces,
    dets: F64,
) -> int:
    """Fill box, plane and edges of the faces that may be visible; return their number."""
    vertices, faces, normals, sides = geometry.vertices, geometry.faces, geometry.face_normals, geometry.side
    first, closed, A, o = geometry.first_face, geometry.closed, objects.A, objects.o
    box, q, edges, face, obj, side = prims.box, prims.q, prims.edges, prims.face, prims.obj, prims.side
    shift, w_near = view.tile_shift[-1], 1.0 / view.q_max
    left, right = shift[0] - 1.0, view.width + shift[1]
    top, bottom = shift[2] - 1.0, view.height + shift[3]
    n = 0
    for j in range(in_view.shape[0]):
        for f in range(first[j], first[j + 1] if in_view[j] else first[j]):
            v, nx, ny, nz = faces[f, 0], normals[f, 0], normals[f, 1], normals[f, 2]
            above = (
                nx * (o[j, 0] - vertices[v, 0])
                + ny * (o[j, 1] - vertices[v, 1])
                + nz * (o[j, 2] - vertices[v, 2])
            )
            if above == 0.0 or (closed[j] and above < 0.0):
                continue
            x0, x1, y0, y1 = _bounds(p, faces, f, w_near)
            if x0 > x1 or x1 < left or x0 > right or y1 < top or y0 > bottom:
                continue
            dets[n] = _edges(p, faces, f, edges, n)
            if dets[n] == 0.0:
                continue
            for k in range(3):
                q[n, k] = -(nx * A[j, 0, k] + ny * A[j, 1, k] + nz * A[j, 2, k]) / above
            box[n, 0], box[n, 1], box[n, 2], box[n, 3] = x0, x1, y0, y1
            face[n], obj[n], side[n] = f, j, sides[f]
            n += 1
    return n


@part
def _light_smooth(
    n: int, det: float, geometry: SceneGeometry, corners: ProjectedVertices, prims: VisibleFaces
) -> None:
    """Interpolate a triangle's light and, where needed, its mapping weights between its corners."""
    f = prims.face[n]
    a, b, c = geometry.faces[f, 0], geometry.faces[f, 1], geometry.faces[f, 2]
    light, weights, e = corners.light, corners.weights, prims.edges
    axis = prims.side[n] >> 1
    only = weights[a, axis] + weights[b, axis] + weights[c, axis] >= 3.0 - 1e-9
    bits = 8
    for k in range(3):
        prims.light[n, k] = (light[a] * e[n, 1, k] + light[b] * e[n, 2, k] + light[c] * e[n, 0, k]) / det
        if geometry.face_normals[f, k] > 0.0:
            bits |= 1 << k
        if not only:
            for turn in range(3):
                wa, wb, wc = weights[a, turn], weights[b, turn], weights[c, turn]
                prims.weights[n, turn, k] = (wa * e[n, 1, k] + wb * e[n, 2, k] + wc * e[n, 0, k]) / det
    prims.blend[n] = 0 if only else bits


@part
def _light_flat(
    n: int, normal: F64, o: F64, vertex: F64, lamp: F64, ambient: float, prims: VisibleFaces
) -> None:
    """Set the uniform light of a flat face; a face seen from behind is lit from behind."""
    above = normal[0] * (o[0] - vertex[0]) + normal[1] * (o[1] - vertex[1]) + normal[2] * (o[2] - vertex[2])
    towards = normal[0] * lamp[0] + normal[1] * lamp[1] + normal[2] * lamp[2]
    light = ambient + (1.0 - ambient) * max(0.0, towards if above >= 0.0 else -towards)
    for k in range(3):
        prims.light[n, k] = light * prims.q[n, k]
    prims.blend[n] = 0


@kernel
def set_up(
    geometry: SceneGeometry,
    objects: ObjectTable,
    ambient: float,
    view: KernelView,
    corners: ProjectedVertices,
    prims: VisibleFaces,
) -> int:
    """Fill prims for a view; return the number of faces that may be visible."""
    in_view = _transform(geometry, objects, ambient, view, corners)
    dets = np.empty(geometry.faces.shape[0])
    count = _place(geometry, objects, in_view, view, corners.p, prims, dets)
    smooth = geometry.smooth
    for n in range(count):
        j, f = prims.obj[n], prims.face[n]
        if smooth[j]:
            _light_smooth(n, dets[n], geometry, corners, prims)
        else:
            vertex = geometry.vertices[geometry.faces[f, 0]]
            _light_flat(n, geometry.face_normals[f], objects.o[j], vertex, objects.lamp[j], ambient, prims)
    return int(count)
