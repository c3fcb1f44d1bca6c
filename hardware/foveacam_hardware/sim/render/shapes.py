"""Shapes in their own coordinates (metres): quads, boxes, triangle meshes and generators of meshes.

A material is evaluated at the hit point in these coordinates. A quad lies in z = 0, visible from both sides,
its x to the right and y down as seen from −z; boxes and meshes are closed, with faces outwards.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foveacam_hardware.contract.errors import InvalidInput

F64 = NDArray[np.float64]
I32 = NDArray[np.int32]


def _sizes(name: str, **sizes_m: float) -> None:
    for size, value in sizes_m.items():
        if not (np.isfinite(value) and value > 0):
            raise InvalidInput(f"{name}: {size} = {value} m; pass a finite length above 0")


@dataclass(frozen=True, kw_only=True, slots=True)
class Quad:
    """A flat rectangle about its origin, in the plane z = 0."""

    width_m: float
    height_m: float

    def __post_init__(self) -> None:
        _sizes("quad", width_m=self.width_m, height_m=self.height_m)


@dataclass(frozen=True, kw_only=True, slots=True)
class Box:
    """A box about its origin."""

    width_m: float
    height_m: float
    depth_m: float

    def __post_init__(self) -> None:
        _sizes("box", width_m=self.width_m, height_m=self.height_m, depth_m=self.depth_m)


@dataclass(frozen=True, kw_only=True, eq=False)
class Mesh:
    """A closed triangle mesh, shaded smoothly or, for visible edges, by facet.

    Attributes:
        vertices_m: (n, 3) float64.
        faces: (m, 3) int32, counter-clockwise seen from outside in a right-handed frame.
        smooth: interpolate the light between vertex normals.
    """

    vertices_m: F64
    faces: I32
    smooth: bool = True

    def __post_init__(self) -> None:
        vertices = np.ascontiguousarray(self.vertices_m, dtype=np.float64)
        faces = np.ascontiguousarray(self.faces, dtype=np.int32)
        if vertices.ndim != 2 or vertices.shape[1] != 3 or not np.isfinite(vertices).all():
            raise InvalidInput(f"mesh: asked for finite vertices (n, 3), found {vertices.shape}")
        if faces.ndim != 2 or faces.shape[1] != 3 or len(faces) == 0:
            raise InvalidInput(f"mesh: asked for faces (m, 3), found {faces.shape}")
        if faces.min() < 0 or faces.max() >= len(vertices):
            raise InvalidInput(
                f"mesh: a face names vertex {faces.max()} of {len(vertices)}; indices start at 0"
            )
        object.__setattr__(self, "vertices_m", vertices)
        object.__setattr__(self, "faces", faces)

    def vertex_normals(self) -> F64:
        """Return unit normals (n, 3), the mean of the faces about each vertex weighted by area."""
        v, f = self.vertices_m, self.faces
        flat = np.cross(v[f[:, 1]] - v[f[:, 0]], v[f[:, 2]] - v[f[:, 0]])
        normals = np.zeros_like(v)
        for corner in range(3):
            np.add.at(normals, f[:, corner], flat)
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        unit: F64 = normals / np.where(length > 0, length, 1.0)
        return unit


Shape = Quad | Box | Mesh


def ground(*, width_m: float, length_m: float) -> Quad:
    """Return a floor, to be posed with `flat`."""
    return Quad(width_m=width_m, height_m=length_m)


def place(
    position_m: ArrayLike = (0.0, 0.0, 0.0),
    *,
    yaw_rad: float = 0.0,
    pitch_rad: float = 0.0,
    roll_rad: float = 0.0,
) -> F64:
    """Return scene_from_object (4, 4): roll about z, pitch about x, yaw about y (down), then move."""
    cy, sy, cp, sp = np.cos(yaw_rad), np.sin(yaw_rad), np.cos(pitch_rad), np.sin(pitch_rad)
    cr, sr = np.cos(roll_rad), np.sin(roll_rad)
    yaw = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    pitch = np.array([[1, 0, 0], [0, cp, -sp], [0, sp, cp]])
    roll = np.array([[cr, -sr, 0], [sr, cr, 0], [0, 0, 1]])
    pose: F64 = np.eye(4)
    pose[:3, :3] = yaw @ pitch @ roll
    pose[:3, 3] = np.asarray(position_m, dtype=np.float64)
    return pose


def flat(position_m: ArrayLike) -> F64:
    """Return the pose of a quad that faces up: its x to the right, its y towards the viewer (−z)."""
    return place(position_m, pitch_rad=-np.pi / 2)


def _grid_faces(rows: int, columns: int) -> I32:
    """Return the triangles of a grid of `rows` x `columns` vertices, cyclic in its columns."""
    i, j = np.meshgrid(np.arange(rows - 1), np.arange(columns), indexing="ij")
    a, b = i * columns + j, i * columns + (j + 1) % columns
    c, d = a + columns, b + columns
    lower = np.stack([a, b, c], axis=-1).reshape(-1, 3)
    upper = np.stack([b, d, c], axis=-1).reshape(-1, 3)
    faces: I32 = np.concatenate([lower, upper]).astype(np.int32)
    return faces


def _without_slivers(vertices: F64, faces: I32) -> Mesh:
    """Return the mesh without triangles of zero area (at the poles), faces outwards from the origin."""
    corners = vertices[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outwards = np.einsum("ij,ij->i", normal, corners.mean(axis=1)) >= 0
    faces = np.where(outwards[:, None], faces, faces[:, ::-1])
    kept = np.linalg.norm(normal, axis=1) > 1e-15
    return Mesh(vertices_m=vertices, faces=faces[kept].astype(np.int32))


def sphere(*, radius_m: float, rings: int = 32) -> Mesh:
    """Return a UV sphere of `rings` bands from pole to pole (4·rings² triangles about)."""
    _sizes("sphere", radius_m=radius_m)
    polar = np.linspace(0, np.pi, rings + 1)
    around = np.linspace(0, 2 * np.pi, 2 * rings, endpoint=False)
    p, a = np.meshgrid(polar, around, indexing="ij")
    vertices = np.stack([np.sin(p) * np.cos(a), -np.cos(p), np.sin(p) * np.sin(a)], axis=-1).reshape(-1, 3)
    return _without_slivers(vertices * radius_m, _grid_faces(rings + 1, 2 * rings))


def column(*, radius_m: float, height_m: float, sides: int = 64, bands: int = 8) -> Mesh:
    """Return an upright cylinder about y, with lids."""
    _sizes("column", radius_m=radius_m, height_m=height_m)
    around = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    y = np.concatenate([[-0.5, -0.5], np.linspace(-0.5, 0.5, bands + 1), [0.5, 0.5]]) * height_m
    r = np.concatenate([[0.0, radius_m], np.full(bands + 1, radius_m), [radius_m, 0.0]])
    rows = len(y)
    vertices = np.stack(
        [np.outer(r, np.cos(around)), np.repeat(y[:, None], sides, axis=1), np.outer(r, np.sin(around))],
        axis=-1,
    )
    return _without_slivers(vertices.reshape(-1, 3), _grid_faces(rows, sides))


def statue(*, height_m: float, seed: int = 0, detail: int = 100) -> Mesh:
    """Return an upright, lumpy, star-shaped figure of 2·detail² triangles about (20 000 by default)."""
    _sizes("statue", height_m=height_m)
    rng = np.random.default_rng(seed)
    polar = np.linspace(0, np.pi, detail // 2 + 1)
    around = np.linspace(0, 2 * np.pi, 2 * detail, endpoint=False)
    p, a = np.meshgrid(polar, around, indexing="ij")
    unit = np.stack([np.sin(p) * np.cos(a), -np.cos(p), np.sin(p) * np.sin(a)], axis=-1)
    radius = np.ones(p.shape)
    for frequency in np.geomspace(1.5, 14.0, 28):
        direction = rng.normal(size=3)
        wave = unit @ (direction / np.linalg.norm(direction)) * frequency
        radius += 0.11 / frequency**0.8 * np.sin(wave * np.pi / 2 + rng.uniform(0, 2 * np.pi))
    waist = 0.52 + 0.12 * np.cos(3.2 * np.pi * unit[..., 1]) + 0.1 * unit[..., 1]
    vertices = unit * radius[..., None] * np.stack([waist, np.ones(p.shape), waist], axis=-1)
    vertices = vertices.reshape(-1, 3)
    middle = (vertices[:, 1].max() + vertices[:, 1].min()) / 2
    vertices[:, 1] -= middle
    vertices *= height_m / np.ptp(vertices[:, 1])
    return _without_slivers(vertices, _grid_faces(detail // 2 + 1, 2 * detail))


# A figurine's outline, (radius, height) as shares of its height: foot, plinth, robe, arms, neck, head.
OUTLINE = np.array(
    [
        (0.000, 0.000), (0.190, 0.000), (0.195, 0.030), (0.170, 0.050), (0.170, 0.075), (0.140, 0.090),
        (0.155, 0.180), (0.130, 0.340), (0.105, 0.460), (0.120, 0.560), (0.150, 0.660), (0.145, 0.720),
        (0.075, 0.765), (0.048, 0.790), (0.052, 0.810), (0.082, 0.850), (0.090, 0.900), (0.078, 0.950),
        (0.045, 0.985), (0.000, 1.000),
    ]
)  # fmt: skip


def figurine(*, height_m: float, triangles: int) -> Mesh:
    """Return a draped figure with folds, of about `triangles` triangles, its base at the origin, up is −y."""
    rings = max(10, round(np.sqrt(triangles / 4.0)))
    sides = 2 * rings
    along = np.linspace(0.0, 1.0, rings + 1)
    steps = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(OUTLINE, axis=0), axis=1))])
    marks = along * steps[-1]
    radius = np.interp(marks, steps, OUTLINE[:, 0])
    height = np.interp(marks, steps, OUTLINE[:, 1])
    around = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)
    up, turn = np.meshgrid(height, around, indexing="ij")
    folds = 0.07 * np.sin(9 * turn + 8.0 * up) + 0.04 * np.sin(17 * turn - 21.0 * up)
    drape = np.clip((up - 0.09) / 0.1, 0.0, 1.0) * np.clip((0.74 - up) / 0.1, 0.0, 1.0)
    shoulders = 0.35 * np.exp(-(((up - 0.64) / 0.1) ** 2)) * np.cos(2 * turn)
    face = np.exp(-(((up - 0.89) / 0.06) ** 2)) * (
        0.16 * np.exp(-(((np.cos(turn + np.pi / 2) - 1.0) / 0.06) ** 2)) - 0.05 * np.cos(2 * turn)
    )
    swollen = radius[:, None] * (1.0 + folds * drape + shoulders + face)
    lean = 0.03 * np.sin(2.2 * np.pi * up)
    vertices = np.stack([swollen * np.cos(turn) + lean, -up, swollen * np.sin(turn)], axis=-1)
    return _revolved_mesh(vertices * height_m)


def truncated_cone(*, radius_m: float, top_radius_m: float, height_m: float, sides: int) -> Mesh:
    """Return an upright truncated cone about its middle, with lids."""
    radius = np.array([0.0, radius_m, radius_m, top_radius_m, top_radius_m, 0.0])
    height = np.array([0.5, 0.5, 0.5, -0.5, -0.5, -0.5]) * height_m
    turn = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)
    grid = np.stack(
        [
            np.outer(radius, np.cos(turn)),
            np.repeat(height[:, None], sides, axis=1),
            np.outer(radius, np.sin(turn)),
        ],
        axis=-1,
    )
    return _revolved_mesh(grid)


def _revolved_mesh(grid_m: NDArray[np.float64]) -> Mesh:
    """Return the closed mesh of rings (r, s, 3) ordered from the base (+y) to the top (-y)."""
    rings, sides = grid_m.shape[:2]
    faces = _grid_faces(rings, sides)
    vertices = grid_m.reshape(-1, 3)
    corners = vertices[faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return Mesh(vertices_m=vertices, faces=faces[area > 1e-14])
