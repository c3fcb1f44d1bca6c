"""Turned shapes for scenes: surfaces of revolution with a carved relief, feet at the origin, up is -y."""

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.sim.render.shapes import Mesh

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
    """Return a draped figure of about `triangles` triangles, folds and all, standing on the origin."""
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
    return _turned(vertices * height_m)


def cone_stump(*, radius_m: float, top_radius_m: float, height_m: float, sides: int) -> Mesh:
    """Return an upright stump of a cone about its middle, with lids."""
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
    return _turned(grid)


def _turned(grid_m: NDArray[np.float64]) -> Mesh:
    """Return the closed mesh of rings (r, s, 3) that run from the foot (+y) to the top (-y)."""
    rings, sides = grid_m.shape[:2]
    i, j = np.meshgrid(np.arange(rings - 1), np.arange(sides), indexing="ij")
    a, b = i * sides + j, i * sides + (j + 1) % sides
    c, d = a + sides, b + sides
    faces = np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, b, c), (b, d, c))])
    vertices = grid_m.reshape(-1, 3)
    corners = vertices[faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return Mesh(vertices_m=vertices, faces=faces[area > 1e-14].astype(np.int32))
