"""Triangulation off the axis, its standard error, meeting rays and verging."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foveacam_hardware.contract import InvalidInput, OutOfRange
from foveacam_pipeline.geometry import (
    closest_approach,
    depth_from_disparity_m,
    depth_sigma_m,
    eye_angles,
    point_from_direction,
    point_on_ray,
    points_from_plane,
    range_sigma_m,
    ray,
    vergence_angles,
)

F_PX, B_M = 28_760.0, 0.2
LEFT_M, RIGHT_M = np.array([-B_M / 2, 0.0, 0.0]), np.array([B_M / 2, 0.0, 0.0])
STEER = st.floats(-0.2, 0.2)
DISTANCE = st.floats(1.0, 50.0)


@settings(deadline=None)
@given(ax=STEER, ay=STEER, distance_m=DISTANCE)
def test_disparity_gives_back_the_point_off_the_axis_too(ax: float, ay: float, distance_m: float) -> None:
    point = point_from_direction(ax, ay, distance_m)
    left, right = (F_PX * (point - eye)[:2] / point[2] for eye in (LEFT_M, RIGHT_M))
    z = depth_from_disparity_m(left[0] - right[0], f_px=F_PX, baseline_m=B_M)
    found = points_from_plane([left], z.reshape(1), f_px=F_PX, baseline_m=B_M)[0]
    np.testing.assert_allclose(found, point, rtol=1e-9, atol=1e-9)


@settings(deadline=None)
@given(ax=STEER, ay=STEER, distance_m=DISTANCE)
def test_verged_gazes_meet_at_the_target(ax: float, ay: float, distance_m: float) -> None:
    left, right = vergence_angles(ax, ay, distance_m, pivots_rig_m=(LEFT_M, RIGHT_M))
    meeting = closest_approach(LEFT_M, ray(*left), RIGHT_M, ray(*right))
    target = point_from_direction(ax, ay, distance_m)
    assert meeting.in_front
    # Directions hold 1e-16; over an angle of B/Z that is Z²/B of range.
    np.testing.assert_allclose(meeting.point_m, target, atol=1e-13 * distance_m**2 / B_M)
    # Of that, B/Z lies across the gazes.
    assert np.linalg.norm(meeting.gap_m) < 1e-13 * distance_m


def test_mirrored_disparity_formula_would_be_wrong_off_the_axis() -> None:
    # Half the vergence angle, as if the target stood straight ahead, is 3 % too far at 10 degrees.
    left, right = vergence_angles(math.radians(10.0), 0.0, 5.0, pivots_rig_m=(LEFT_M, RIGHT_M))
    naive_z_m = (B_M / 2) / math.tan((left[0] - right[0]) / 2)
    exact_z_m = float(closest_approach(LEFT_M, ray(*left), RIGHT_M, ray(*right)).point_m[2])
    assert exact_z_m == pytest.approx(5.0 * math.cos(math.radians(10.0)), rel=1e-9)
    assert naive_z_m / exact_z_m == pytest.approx(1.031, abs=2e-3)


def test_infinitely_far_means_parallel() -> None:
    pair = vergence_angles(0.1, -0.05, math.inf, pivots_rig_m=(LEFT_M, RIGHT_M))
    assert pair == ((0.1, -0.05), (0.1, -0.05))
    assert not closest_approach(LEFT_M, ray(*pair[0]), RIGHT_M, ray(*pair[1])).in_front


def test_parting_gazes_do_not_meet_in_front() -> None:
    assert not closest_approach(LEFT_M, ray(-0.01, 0.0), RIGHT_M, ray(0.01, 0.0)).in_front


def test_vertical_mismatch_is_the_angle_between_the_gazes() -> None:
    left, right = vergence_angles(0.0, 0.0, 5.0, pivots_rig_m=(LEFT_M, RIGHT_M))
    meeting = closest_approach(LEFT_M, ray(*left), RIGHT_M, ray(right[0], right[1] + 1e-3))
    assert meeting.vertical_rad == pytest.approx(1e-3, rel=0.01)  # the right eye aims lower by 1 mrad
    assert meeting.point_m[2] == pytest.approx(5.0, rel=1e-3)


def test_no_disparity_is_infinity_and_unknown_stays_unknown() -> None:
    z = depth_from_disparity_m([0.0, -3.0, np.nan, F_PX * B_M], f_px=F_PX, baseline_m=B_M)
    np.testing.assert_array_equal(z, [np.inf, np.inf, np.nan, 1.0])


def test_depth_sigma_is_the_slope_of_depth() -> None:
    d, step = 577.0, 1e-3
    near, far = depth_from_disparity_m([d + step, d - step], f_px=F_PX, baseline_m=B_M)
    z = depth_from_disparity_m(d, f_px=F_PX, baseline_m=B_M)
    sigma = depth_sigma_m(z, 0.25, f_px=F_PX, baseline_m=B_M)
    assert float(sigma) == pytest.approx(0.25 * (far - near) / (2 * step), rel=1e-6)
    assert float(sigma) == pytest.approx(4.32e-3, rel=0.01)  # a quarter pixel at 10 m


def test_range_sigma_follows_the_left_ray() -> None:
    point = point_from_direction(0.17, 0.1, 10.0)
    plane = F_PX * (point - LEFT_M)[:2] / point[2]
    step_m = 1e-4
    moved = points_from_plane([plane], np.array([point[2] + step_m]), f_px=F_PX, baseline_m=B_M)[0]
    expected = (np.linalg.norm(moved) - np.linalg.norm(point)) / step_m
    assert range_sigma_m([point], 1.0, baseline_m=B_M)[0] == pytest.approx(expected, rel=1e-4)


def test_simulated_noise_of_disparity_spreads_depth_as_stated() -> None:
    noise_px, z_m = 0.25, 12.0
    d = F_PX * B_M / z_m
    drawn = d + noise_px * np.random.default_rng(0).standard_normal(20_000)
    spread = np.std(depth_from_disparity_m(drawn, f_px=F_PX, baseline_m=B_M))
    stated = depth_sigma_m(z_m, noise_px, f_px=F_PX, baseline_m=B_M)
    assert spread == pytest.approx(float(stated), rel=0.02)  # 20 000 draws know it to 0.5 %


@settings(deadline=None)
@given(ax=STEER, ay=STEER, distance_m=DISTANCE)
def test_a_point_on_a_ray_lies_at_its_distance(ax: float, ay: float, distance_m: float) -> None:
    point = point_on_ray(LEFT_M, ray(ax, ay), distance_m)
    assert np.linalg.norm(point) == pytest.approx(distance_m)
    np.testing.assert_allclose(eye_angles(point, LEFT_M), (ax, ay), atol=1e-12)


@pytest.mark.parametrize("distance_m", [0.0, -1.0, math.nan, math.inf])
def test_a_distance_that_is_none_is_refused(distance_m: float) -> None:
    with pytest.raises(OutOfRange, match="target distance"):
        point_from_direction(0.0, 0.0, distance_m)


def test_a_target_behind_the_mirror_is_refused() -> None:
    with pytest.raises(OutOfRange, match="behind"):
        eye_angles([0.0, 0.0, -1.0], LEFT_M)


def test_a_distance_within_the_rig_is_refused() -> None:
    with pytest.raises(OutOfRange, match=r"nearer than the eye itself \(0\.100 m\)"):
        point_on_ray(LEFT_M, ray(0.0, 0.0), 0.05)


def test_depths_of_another_number_than_points_are_refused() -> None:
    with pytest.raises(InvalidInput, match="depth_m"):
        points_from_plane([[0.0, 0.0]], [1.0, 2.0], f_px=F_PX, baseline_m=B_M)
