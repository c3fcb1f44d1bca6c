"""The wide context becomes a surface, points and a picture."""

import numpy as np
import pytest

from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.wide_depth.rendering import (
    BACKDROP_BEHIND,
    BEHIND,
    backdrop_mesh,
    context_cloud,
    context_mesh,
    context_picture,
    filled,
    without_specks,
)
from foveacam_pipeline.wide_depth.values import ContextMap

WIDE = Intrinsics(width=80, height=64, fx_px=200.0, fy_px=200.0, cx_px=39.5, cy_px=31.5)
PICTURE = np.random.default_rng(2).integers(0, 255, (64, 80, 3), dtype=np.uint8)


@pytest.fixture
def known() -> ContextMap:
    """A wall at 4 m, at its right a nearer one at 2 m."""
    found = ContextMap.empty(rows=8, columns=10, cell_px=8)
    x, y = np.meshgrid(np.arange(10) * 8 + 3.5, np.arange(8) * 8 + 3.5)
    tangents = np.tan(WIDE.angles_rad(np.column_stack([x.ravel(), y.ravel()])))
    found.tangents[0] = tangents.reshape(8, 10, 2)
    found.inverse_z_per_m[0] = np.where(x < 40, 0.25, 0.5)
    found.sigma_per_m[0] = 1e-3
    return found


def test_the_surface_is_torn_between_a_near_and_a_far_wall(known: ContextMap) -> None:
    mesh = context_mesh(known, PICTURE, WIDE)
    assert len(mesh.faces) == 2 * (7 * 4 + 7 * 4)
    depths = mesh.vertices_rig_m[mesh.faces][:, :, 2]
    np.testing.assert_allclose(np.ptp(depths, axis=1), 0.0, atol=1e-5)
    assert sorted(set(np.round(depths.ravel(), 3))) == pytest.approx([2.0 * BEHIND, 4.0 * BEHIND], abs=1e-3)


def test_texture_coordinates_name_the_cells_own_pixels(known: ContextMap) -> None:
    mesh = context_mesh(known, PICTURE, WIDE)
    pixels = mesh.uv * (80, 64) - 0.5
    tangents = mesh.vertices_rig_m[:, :2] / mesh.vertices_rig_m[:, 2:]
    np.testing.assert_allclose(pixels, WIDE.pixels(np.arctan(tangents)), atol=1e-3)


def test_faces_look_towards_the_rig(known: ContextMap) -> None:
    mesh = context_mesh(known, PICTURE, WIDE)
    a, b, c = (mesh.vertices_rig_m[mesh.faces[:, corner]] for corner in range(3))
    assert (np.einsum("ij,ij->i", np.cross(b - a, c - a), a) < 0.0).all()


def test_a_map_without_depth_has_no_faces_and_no_points() -> None:
    empty = ContextMap.empty(rows=8, columns=10, cell_px=8)
    assert len(context_mesh(empty, PICTURE, WIDE).faces) == 0
    assert len(context_cloud(empty, PICTURE, WIDE)) == 0
    assert context_picture(empty).shape[0] == 8 * 4


def test_the_backdrop_covers_the_whole_view_behind_what_was_measured(known: ContextMap) -> None:
    mesh = backdrop_mesh(known, PICTURE, WIDE)
    assert mesh is not None
    assert (mesh.uv.min(), mesh.uv.max()) == pytest.approx((0.0, 1.0), abs=1e-6)
    z_m = mesh.vertices_rig_m[:, 2]
    assert z_m == pytest.approx(4.0 * BACKDROP_BEHIND, rel=1e-3)  # the near wall stands before it
    a, b, c = (mesh.vertices_rig_m[mesh.faces[:, corner]] for corner in range(3))
    assert (np.einsum("ij,ij->i", np.cross(b - a, c - a), a) < 0.0).all()  # faces look towards the rig
    assert np.ptp(mesh.texture, axis=2).max() == 0  # grey: it is not measured
    assert mesh.texture.std() < 0.7 * PICTURE.std()


def test_without_any_depth_there_is_no_backdrop() -> None:
    assert backdrop_mesh(ContextMap.empty(rows=8, columns=10, cell_px=8), PICTURE, WIDE) is None


def test_unknown_cells_are_filled_from_the_known_ones_which_stay() -> None:
    q = np.full((37, 50), np.nan)
    q[5, 5], q[30, 44] = 0.5, 0.1
    whole = filled(q)
    assert whole is not None
    assert (whole[5, 5], whole[30, 44]) == (0.5, 0.1)
    assert np.isfinite(whole).all() and whole.min() >= 0.1 and whole.max() <= 0.5
    assert whole[6, 7] > 0.4 and whole[31, 42] < 0.2
    assert filled(np.full((3, 4), np.nan)) is None


def test_points_carry_both_surfaces_with_the_wide_views_colours(known: ContextMap) -> None:
    known.inverse_z_per_m[1, 2, 3] = 0.4
    known.sigma_per_m[1, 2, 3] = 1e-3
    known.tangents[1, 2, 3] = known.tangents[0, 2, 3]
    cloud = context_cloud(known, PICTURE, WIDE)
    assert len(cloud) == 81
    assert cloud.points_rig_m[80, 2] == pytest.approx(2.5)
    assert cloud.sigma_m[80] == pytest.approx(1e-3 * 2.5**2)
    assert (cloud.colors[80] == cloud.colors[23]).all()


def test_a_single_cell_that_no_neighbour_continues_is_left_out(known: ContextMap) -> None:
    known.inverse_z_per_m[0, 3, 2] = 0.7
    cleaned = without_specks(known)
    assert np.isnan(cleaned.inverse_z_per_m[0, 3, 2])
    assert np.count_nonzero(cleaned.known) == np.count_nonzero(known.known) - 1
    assert known.inverse_z_per_m[0, 3, 2] == 0.7
