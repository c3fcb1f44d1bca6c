"""The scene: shapes with materials and poses, a sky and a lamp, flattened into arrays for the kernels.

Poses may change at any time and from any thread; a frame is rendered from a snapshot.
"""

import threading
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foveacam_hardware.contract.errors import InvalidInput
from foveacam_hardware.sim.render.materials import Color, Material, MaterialTables, pack
from foveacam_hardware.sim.render.shapes import Box, Mesh, Quad, Shape

F64 = NDArray[np.float64]
I32 = NDArray[np.int32]


@dataclass(frozen=True, kw_only=True, slots=True)
class Lighting:
    """A distant lamp and a sky, fixed in the scene's frame.

    Attributes:
        lamp: direction towards the lamp (any length).
        ambient: light on a face turned away from the lamp, 0..1.
        horizon: colour of the background level with the camera.
        zenith: colour of the background straight up (−y).
    """

    lamp: tuple[float, float, float] = (-0.45, -0.8, -0.55)
    ambient: float = 0.45
    horizon: Color = (0.62, 0.66, 0.7)
    zenith: Color = (0.28, 0.42, 0.62)

    def __post_init__(self) -> None:
        if not np.linalg.norm(self.lamp) > 0:
            raise InvalidInput("lighting: the lamp's direction is zero; pass a direction")
        if not 0.0 <= self.ambient <= 1.0:
            raise InvalidInput(f"lighting: ambient = {self.ambient}; pass 0..1")


class SceneGeometry(NamedTuple):
    """All shapes in their own coordinates, as flat arrays, one object after another."""

    vertices: F64  # (v, 3)
    normals: F64  # (v, 3) unit, zero where faces are flat
    faces: I32  # (f, 4) vertex indices, the fourth −1 for a triangle
    face_normals: F64  # (f, 3) unit, outwards, object coordinates
    side: I32  # (f,) 2·axis + 1 if it looks along +axis: the plane of (u, v) and its sign
    first_vertex: I32  # (n + 1,)
    first_face: I32  # (n + 1,)
    closed: I32  # (n,) 1 = faces seen from behind are hidden by others
    bounds: F64  # (n, 8, 3) corners of each object's box
    smooth: I32  # (n,) 1 = light and texture are continuous across faces


class SceneSnapshot(NamedTuple):
    """A consistent state of the scene, from which a frame is rendered."""

    revision: int
    geometry: SceneGeometry
    tables: MaterialTables
    poses: F64  # (n, 4, 4) scene_from_object
    moved: NDArray[np.int64]  # (n,) revision at which each object last moved
    lamp: F64  # (3,) unit, towards the lamp
    ambient: float
    sky: F64  # (2, 3) horizon, zenith


class _Part(NamedTuple):
    vertices: F64
    normals: F64
    faces: I32
    face_normals: F64
    closed: int
    smooth: int


def _quad(quad: Quad) -> _Part:
    x, y = quad.width_m / 2, quad.height_m / 2
    vertices = np.array([[-x, -y, 0], [x, -y, 0], [x, y, 0], [-x, y, 0]])
    faces = np.array([[0, 1, 2, 3]], np.int32)
    return _Part(vertices, np.zeros((4, 3)), faces, np.array([[0.0, 0.0, -1.0]]), 0, 0)


def _box(box: Box) -> _Part:
    corner = np.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)]) - 0.5
    vertices = corner * [box.width_m, box.height_m, box.depth_m]
    faces, normals = [], []
    for axis in range(3):
        u, v = 1 << (axis + 1) % 3, 1 << (axis + 2) % 3
        for sign in (0, 1):
            start = sign << axis
            faces.append([start, start + u, start + u + v, start + v])
            normals.append([(2.0 * sign - 1.0) * (axis == k) for k in range(3)])
    return _Part(vertices, np.zeros((8, 3)), np.array(faces, np.int32), np.array(normals), 1, 0)


def _mesh(mesh: Mesh) -> _Part:
    corners = mesh.vertices_m[mesh.faces]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(flat, axis=1, keepdims=True)
    flat = flat / np.where(length > 0, length, 1.0)
    faces = np.column_stack([mesh.faces, np.full(len(mesh.faces), -1)]).astype(np.int32)
    normals = mesh.vertex_normals() if mesh.smooth else np.zeros_like(mesh.vertices_m)
    return _Part(mesh.vertices_m, normals, faces, flat, 1, int(mesh.smooth))


def _part(shape: Shape) -> _Part:
    if isinstance(shape, Quad):
        return _quad(shape)
    return _box(shape) if isinstance(shape, Box) else _mesh(shape)


def _box_corners(vertices: F64) -> F64:
    ends = np.stack([vertices.min(axis=0), vertices.max(axis=0)])
    corners: F64 = np.array([[ends[i >> k & 1, k] for k in range(3)] for i in range(8)])
    return corners


def _flatten(parts: list[_Part]) -> SceneGeometry:
    first_vertex = np.cumsum([0] + [len(p.vertices) for p in parts]).astype(np.int32)
    first_face = np.cumsum([0] + [len(p.faces) for p in parts]).astype(np.int32)
    faces = [np.where(p.faces < 0, -1, p.faces + v) for p, v in zip(parts, first_vertex, strict=False)]
    face_normals = np.concatenate([np.zeros((0, 3))] + [p.face_normals for p in parts])
    axis = np.argmax(np.abs(face_normals), axis=1) if len(face_normals) else np.zeros(0, np.intp)
    positive = np.take_along_axis(face_normals, axis[:, None], axis=1)[:, 0] > 0
    return SceneGeometry(
        np.concatenate([np.zeros((0, 3))] + [p.vertices for p in parts]),
        np.concatenate([np.zeros((0, 3))] + [p.normals for p in parts]),
        np.concatenate([np.zeros((0, 4), np.int32), *faces]).astype(np.int32),
        face_normals,
        (2 * axis + positive).astype(np.int32),
        first_vertex,
        first_face,
        np.array([p.closed for p in parts], np.int32),
        np.array([_box_corners(p.vertices) for p in parts]).reshape(-1, 8, 3),
        np.array([p.smooth for p in parts], np.int32),
    )


def _pose(pose: ArrayLike, name: str) -> F64:
    matrix = np.array(pose, dtype=np.float64)
    if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
        raise InvalidInput(f"pose of {name}: asked for a finite (4, 4) matrix, found {matrix.tolist()}")
    R = matrix[:3, :3]
    rigid = np.abs(R @ R.T - np.eye(3)).max() < 1e-6 and np.linalg.det(R) > 0
    if not rigid or not np.array_equal(matrix[3], [0, 0, 0, 1]):
        raise InvalidInput(
            f"pose of {name}: found scale, shear or reflection in {matrix.tolist()}; pass a rotation"
        )
    return matrix


class Scene:
    """Objects by number, in the order of addition; every change increments `revision`."""

    def __init__(self, lighting: Lighting | None = None) -> None:
        self._lighting = lighting or Lighting()
        self._lock = threading.Lock()
        self._parts: list[_Part] = []
        self._materials: list[Material] = []
        self._names: list[str] = []
        self._poses: list[F64] = []
        self._moved: list[int] = []
        self._revision = 0
        self._flat: tuple[SceneGeometry, MaterialTables] | None = None

    def selected(self, numbers: Sequence[int], lighting: Lighting | None = None) -> "Scene":
        """Return a scene of some of the objects, numbered in that order, where they are now."""
        chosen = Scene(lighting or self._lighting)
        with self._lock:
            for number in numbers:
                part, material = self._parts[number], self._materials[number]
                chosen._append(part, material, self._poses[number], self._names[number])
        return chosen

    @property
    def names(self) -> tuple[str, ...]:
        """Return the objects' names by number."""
        return tuple(self._names)

    def add(self, shape: Shape, material: Material, pose: ArrayLike, name: str) -> int:
        """Add an object; pose: (4, 4) scene_from_object, rigid. Return its number, as found in `ids`."""
        matrix = _pose(pose, name)
        part = _part(shape)
        with self._lock:
            self._append(part, material, matrix, name)
            return len(self._parts) - 1

    def _append(self, part: _Part, material: Material, pose: F64, name: str) -> None:
        self._revision += 1
        self._parts.append(part)
        self._materials.append(material)
        self._names.append(name)
        self._poses.append(pose)
        self._moved.append(self._revision)
        self._flat = None

    def set_pose(self, obj_id: int, pose: ArrayLike) -> None:
        """Move an object; a pose equal to the present one changes nothing."""
        if not 0 <= obj_id < len(self._parts):
            raise InvalidInput(
                f"object {obj_id}: the scene has {len(self._parts)}; pass a number that `add` returned"
            )
        matrix = _pose(pose, self._names[obj_id])
        with self._lock:
            if np.array_equal(matrix, self._poses[obj_id]):
                return
            self._revision += 1
            self._poses[obj_id] = matrix
            self._moved[obj_id] = self._revision

    def pose(self, obj_id: int) -> F64:
        """Return scene_from_object, (4, 4), of an object."""
        return self._poses[obj_id].copy()

    def material(self, obj_id: int) -> Material:
        """Return the material of an object."""
        return self._materials[obj_id]

    def snapshot(self) -> SceneSnapshot:
        """Return the present state, which later changes do not affect."""
        with self._lock:
            if self._flat is None:
                self._flat = (_flatten(self._parts), pack(self._materials))
            geometry, tables = self._flat
            lamp = np.array(self._lighting.lamp, dtype=np.float64)
            return SceneSnapshot(
                self._revision,
                geometry,
                tables,
                np.array(self._poses, dtype=np.float64).reshape(-1, 4, 4),
                np.array(self._moved, dtype=np.int64),
                lamp / np.linalg.norm(lamp),
                self._lighting.ambient,
                np.array([self._lighting.horizon, self._lighting.zenith], dtype=np.float64),
            )
