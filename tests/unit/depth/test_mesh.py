"""Depth meshes: torn at jumps, whole on slopes, facing the rig, textured."""

import functools

import numpy as np
import pytest
from tests.support.scenes.stereo_pairs import BASELINE_M, F_PX, HEIGHT, WIDTH, flat, pair_of

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.stereo.depth import depth_map
from foveacam_pipeline.stereo.mesh import depth_mesh
from foveacam_pipeline.stereo.values import DepthMesh, DisparityMap, RectifiedPair


@functools.cache
def pair() -> RectifiedPair:
    return pair_of(flat(0.0))


def mesh_of(residual_px: np.ndarray, step_px: int = 4) -> DepthMesh:
    found = DisparityMap(
        residual_px=residual_px.astype(np.float32), sigma_px=flat(0.1).astype(np.float32), compute_ms=0.0
    )
    return depth_mesh(pair(), depth_map(pair(), found), step_px=step_px)


def test_a_flat_surface_is_one_sheet() -> None:
    mesh = mesh_of(flat(3.0))
    columns, rows = len(range(2, WIDTH, 4)), len(range(2, HEIGHT, 4))
    assert len(mesh.vertices_rig_m) == columns * rows
    assert len(mesh.faces) == 2 * (columns - 1) * (rows - 1)
    np.testing.assert_allclose(mesh.vertices_rig_m[:, 2], F_PX * BASELINE_M / 283.0, rtol=1e-5)


def test_no_triangle_spans_a_jump_in_depth() -> None:
    residual = flat(0.0)
    residual[:, 240:] = 25.0
    mesh = mesh_of(residual)
    z_m = mesh.vertices_rig_m[mesh.faces, 2]
    assert np.ptp(z_m, axis=1).max() < 1e-3
    assert {round(float(z), 2) for z in z_m.ravel()} == {10.27, 9.43}


def test_a_slope_is_not_torn() -> None:
    residual = np.tile(0.2 * np.arange(WIDTH), (HEIGHT, 1))  # 60 degrees at 2 m
    assert len(mesh_of(residual).faces) == len(mesh_of(flat(0.0)).faces)


def test_unknown_pixels_leave_holes() -> None:
    residual = flat(0.0)
    residual[80:180, 160:320] = np.nan
    mesh = mesh_of(residual)
    u, v = mesh.uv[:, 0] * WIDTH, mesh.uv[:, 1] * HEIGHT
    assert not ((u > 166) & (u < 314) & (v > 86) & (v < 174)).any()
    assert len(mesh.faces) < len(mesh_of(flat(0.0)).faces)
    assert np.isfinite(mesh.vertices_rig_m).all()
    assert set(np.unique(mesh.faces)) == set(range(len(mesh.vertices_rig_m)))  # no loose vertex, none missing


def test_triangles_face_the_rig() -> None:
    rng = np.random.default_rng(4)
    residual = flat(0.0) + np.cumsum(rng.normal(0.0, 0.05, (HEIGHT, WIDTH)), axis=1)
    mesh = mesh_of(residual)
    a, b, c = (mesh.vertices_rig_m[mesh.faces[:, k]].astype(np.float64) for k in range(3))
    normals = np.cross(b - a, c - a)
    assert (np.sum(normals * a, axis=1) < 0.0).all()  # against the line of sight from the origin


def test_the_texture_coordinates_find_the_vertex_in_the_left_window() -> None:
    mesh = mesh_of(flat(0.0))
    columns = (
        F_PX * (mesh.vertices_rig_m[:, 0] + BASELINE_M / 2) / mesh.vertices_rig_m[:, 2] - pair().u0_left_px
    )
    rows = F_PX * mesh.vertices_rig_m[:, 1] / mesh.vertices_rig_m[:, 2] - pair().v0_px
    np.testing.assert_allclose(mesh.uv[:, 0] * WIDTH - 0.5, columns, atol=0.02)
    np.testing.assert_allclose(mesh.uv[:, 1] * HEIGHT - 0.5, rows, atol=0.02)
    assert mesh.texture.shape == (HEIGHT, WIDTH, 3) and mesh.texture.dtype == np.uint8


def test_nothing_known_gives_an_empty_mesh() -> None:
    mesh = mesh_of(flat(np.nan))
    assert len(mesh.vertices_rig_m) == len(mesh.faces) == len(mesh.uv) == 0


def test_a_step_of_nothing_is_refused() -> None:
    with pytest.raises(InvalidInput, match="step of 0 px"):
        mesh_of(flat(0.0), step_px=0)
