"""Clouds: points where the surface is, none on edges, colours and errors, never more than asked for."""

from dataclasses import replace

import numpy as np
import pytest
from tests.support.scenes.stereo_pairs import BASELINE_M, F_PX, HEIGHT, WIDTH, flat, pair_of

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.stereo.depth import cloud, depth_map
from foveacam_pipeline.stereo.values import Cloud, DisparityMap, RectifiedPair


def cloud_of(residual_px: np.ndarray, pair: RectifiedPair | None = None, max_points: int = 50_000) -> Cloud:
    pair = pair or pair_of(flat(0.0))
    found = DisparityMap(
        residual_px=residual_px.astype(np.float32), sigma_px=flat(0.1).astype(np.float32), compute_ms=0.0
    )
    return cloud(pair, depth_map(pair, found), max_points=max_points)


def test_points_project_back_to_the_pixels_they_came_from() -> None:
    pair = pair_of(flat(0.0))
    points = cloud_of(flat(5.0), pair, max_points=WIDTH * HEIGHT).points_rig_m.astype(np.float64)
    assert len(points) == WIDTH * HEIGHT
    columns = F_PX * (points[:, 0] + BASELINE_M / 2) / points[:, 2] - pair.u0_left_px
    rows = F_PX * points[:, 1] / points[:, 2] - pair.v0_px
    right = F_PX * (points[:, 0] - BASELINE_M / 2) / points[:, 2] - pair.u0_right_px
    grid_columns, grid_rows = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    np.testing.assert_allclose(columns, grid_columns.ravel(), atol=0.01)  # float32 metres: 1 um of 70 um
    np.testing.assert_allclose(rows, grid_rows.ravel(), atol=0.01)
    np.testing.assert_allclose(columns - right, 5.0, atol=0.01)


def test_no_point_hangs_between_two_surfaces() -> None:
    residual = flat(0.0)
    residual[:, 240:] = 30.0
    residual[:, 239] = 15.0  # what a matcher leaves on an edge
    depths_m = F_PX * BASELINE_M / (280.0 + np.array([0.0, 30.0]))
    z_m = cloud_of(residual).points_rig_m[:, 2]
    distance_m = np.abs(z_m[:, None] - depths_m[None, :]).min(axis=1)
    assert distance_m.max() < 1e-4
    assert len(z_m) > 0


@pytest.mark.parametrize("most", [1, 500, 20_000])
def test_there_are_never_more_points_than_asked_for(most: int) -> None:
    found = cloud_of(flat(0.0), max_points=most)
    assert most / 5 <= len(found) <= most  # a stride of whole pixels, spread evenly
    if most > 1:
        assert np.ptp(found.points_rig_m[:, 0]) > 0.9 * WIDTH / F_PX * found.points_rig_m[0, 2]


def test_colours_are_those_of_the_left_window() -> None:
    pair = pair_of(flat(0.0))
    colour = np.stack([pair.left, pair.left // 2, 255 - pair.left], axis=2)
    found = cloud_of(flat(0.0), replace(pair, left=colour), max_points=WIDTH * HEIGHT)
    np.testing.assert_array_equal(found.colors, colour.reshape(-1, 3))
    grey = cloud_of(flat(0.0), pair, max_points=WIDTH * HEIGHT)
    np.testing.assert_array_equal(grey.colors, np.repeat(pair.left.reshape(-1, 1), 3, axis=1))


def test_a_point_carries_both_of_its_errors() -> None:
    pair = pair_of(flat(0.0))
    z_m = F_PX * BASELINE_M / 280.0
    expected_m = z_m**2 / (F_PX * BASELINE_M) * np.hypot(0.1, pair.pose_sigma_px)
    np.testing.assert_allclose(cloud_of(flat(0.0), pair).sigma_m, expected_m, rtol=1e-5)


def test_an_empty_depth_map_gives_an_empty_cloud() -> None:
    assert len(cloud_of(flat(np.nan))) == 0


def test_a_cloud_of_no_points_is_refused() -> None:
    with pytest.raises(InvalidInput, match="at least 1"):
        cloud_of(flat(0.0), max_points=0)
