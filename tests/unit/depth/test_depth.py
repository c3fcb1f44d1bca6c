"""Depth of a disparity map and its two errors (Sec. 4.1)."""

import numpy as np
import pytest
from tests.support.scenes.stereo_pairs import BASELINE_M, F_PX, HEIGHT, WIDTH, flat, pair_of

from foveacam_pipeline.stereo.depth import depth_map, disparity_px, edge_mask
from foveacam_pipeline.stereo.values import DisparityMap


def disparity(residual_px: float, sigma_px: float = 0.1) -> DisparityMap:
    return DisparityMap(
        residual_px=flat(residual_px).astype(np.float32),
        sigma_px=flat(sigma_px).astype(np.float32),
        compute_ms=0.0,
    )


def test_depth_is_focal_length_times_baseline_over_total_disparity() -> None:
    pair = pair_of(flat(0.0), offset_px=300.0)
    z_m = depth_map(pair, disparity(-12.4)).z_m
    np.testing.assert_allclose(z_m, F_PX * BASELINE_M / 287.6, rtol=1e-6)  # float32


def test_depth_returns_to_the_disparity_it_came_from() -> None:
    pair = pair_of(flat(0.0))
    depth = depth_map(pair, disparity(17.25))
    np.testing.assert_allclose(disparity_px(pair, depth) - pair.offset_px, 17.25, atol=1e-3)


def test_the_errors_grow_with_the_square_of_the_depth() -> None:
    near, far = (pair_of(flat(0.0), offset_px=offset_px) for offset_px in (480.0, 240.0))
    near_depth, far_depth = (depth_map(pair, disparity(0.0)) for pair in (near, far))
    np.testing.assert_allclose(far_depth.z_m, 2.0 * near_depth.z_m, rtol=1e-5)
    np.testing.assert_allclose(far_depth.sigma_m, 4.0 * near_depth.sigma_m, rtol=1e-5)
    np.testing.assert_allclose(far_depth.pose_sigma_m, 4.0 * near_depth.pose_sigma_m, rtol=1e-5)


def test_the_errors_are_those_of_section_4_1() -> None:
    pair = pair_of(flat(0.0))
    depth = depth_map(pair, disparity(0.0, sigma_px=0.2))
    z_m = F_PX * BASELINE_M / pair.offset_px
    np.testing.assert_allclose(depth.sigma_m, z_m**2 / (BASELINE_M * F_PX) * 0.2, rtol=1e-5)
    np.testing.assert_allclose(
        depth.pose_sigma_m, z_m**2 / (BASELINE_M * F_PX) * pair.pose_sigma_px, rtol=1e-5
    )


@pytest.mark.parametrize("residual_px", [-280.0, -300.0, np.nan])
def test_at_and_beyond_infinity_there_is_no_depth(residual_px: float) -> None:
    depth = depth_map(pair_of(flat(0.0), offset_px=280.0), disparity(residual_px))
    assert np.isnan(depth.z_m).all() and np.isnan(depth.sigma_m).all()


def test_edges_are_where_disparity_jumps_and_not_where_it_slopes_or_ends() -> None:
    residual = np.tile(np.linspace(0.0, 40.0, WIDTH), (HEIGHT, 1)).astype(np.float32)
    residual[:, 200:] += 12.0
    residual[:, 300:320] = np.nan
    found = DisparityMap(residual_px=residual, sigma_px=flat(0.1).astype(np.float32), compute_ms=0.0)
    pair = pair_of(flat(0.0))
    edges = edge_mask(pair, depth_map(pair, found))
    assert edges[:, 198:202].all()
    assert not edges[:, :195].any() and not edges[:, 205:].any()
