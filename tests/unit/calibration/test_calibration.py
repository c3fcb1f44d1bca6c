"""The calibration of a rig: which rig, which eye, where the gazes meet, how far to trust it."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foveacam_hardware.contract import PARKED, InvalidInput, NotCalibrated, OutOfRange, Role
from foveacam_pipeline.geometry import homography_apply, point_from_direction
from foveacam_pipeline.models import load_calibration
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED

RIG120 = load_calibration(SHIPPED / "sim-rig120.json")


def test_the_own_rig_is_accepted_and_another_named() -> None:
    RIG120.check_rig("sim-rig120")
    with pytest.raises(
        NotCalibrated, match="belongs to rig 'sim-rig120', this rig is 'lab-7'; load this rig's"
    ):
        RIG120.check_rig("lab-7")


def test_each_simulated_rig_has_its_own_certificate() -> None:
    paper = load_calibration(SHIPPED / "sim-paper.json")
    paper.check_rig("sim-paper")
    assert paper.id != RIG120.id
    assert paper.origin == RIG120.origin == "measured"
    assert RIG120.created.tzinfo is not None


def test_the_wide_camera_is_no_eye() -> None:
    assert RIG120.eye(Role.LEFT) is RIG120.left
    assert RIG120.eye(Role.RIGHT) is RIG120.right
    with pytest.raises(InvalidInput, match="wide camera has no mirror"):
        RIG120.eye(Role.WIDE)


def test_the_left_eye_stands_on_the_left() -> None:
    left, right = RIG120.pivot_rig_m(Role.LEFT), RIG120.pivot_rig_m(Role.RIGHT)
    assert right[0] - left[0] == pytest.approx(RIG120.baseline_m, abs=1e-12)
    np.testing.assert_allclose([left, right], [[-0.1, 0, 0], [0.1, 0, 0]], atol=1e-3)  # assembly: < 1 mm


@settings(deadline=None, max_examples=50)
@given(ax=st.floats(-0.1, 0.1), ay=st.floats(-0.1, 0.1), distance_m=st.floats(3.0, 40.0))
def test_steered_gazes_meet_at_the_target(ax: float, ay: float, distance_m: float) -> None:
    meeting = RIG120.meeting(RIG120.steer(ax, ay, distance_m=distance_m))
    target = point_from_direction(ax, ay, distance_m)
    # Newton stops at a millionth of a DAC step: 3 pV of 1 mrad/V; over the vergence that is Z²/B of range.
    np.testing.assert_allclose(meeting.point_m, target, atol=1e-11 * distance_m**2 / RIG120.baseline_m + 1e-9)
    assert np.linalg.norm(meeting.gap_m) < 1e-9


def test_parallel_steering_looks_the_same_way_with_both_eyes() -> None:
    left, right = RIG120.gaze_rad(RIG120.steer(0.05, -0.03))
    np.testing.assert_allclose([left, right], [[0.05, -0.03]] * 2, atol=1e-10)


def test_a_direction_beyond_an_eye_is_refused() -> None:
    with pytest.raises(OutOfRange, match="beyond the calibrated field"):
        RIG120.steer(math.radians(10.5), 0.0)


def test_the_whole_of_the_stated_reach_can_be_steered_to() -> None:
    ax_min, ax_max, ay_min, ay_max = RIG120.reach_rad()
    assert math.degrees(ax_max - ax_min) > 15.0 and math.degrees(ay_max - ay_min) > 14.0  # Sec. 3.1, cut
    for ax in np.linspace(ax_min, ax_max, 7):
        for ay in np.linspace(ay_min, ay_max, 7):
            RIG120.steer(float(ax), float(ay))


def test_near_things_look_wider_from_the_pupil_than_from_the_pivot() -> None:
    far = RIG120.rectification(Role.LEFT, 0.0, 0.0)
    near = RIG120.rectification(Role.LEFT, 0.0, 0.0, depth_m=2.0)
    edge = np.array([[100.0, 539.5], [719.5, 539.5]])
    widths = [np.diff(homography_apply(h, edge)[:, 0])[0] for h in (far, near)]
    assert widths[1] / widths[0] == pytest.approx(1.0 + RIG120.pupil_m / 2.0, abs=1e-6)


def test_rectification_at_infinity_is_the_field_itself() -> None:
    np.testing.assert_allclose(
        RIG120.rectification(Role.RIGHT, 0.02, -0.04), RIG120.right.homography.at(0.02, -0.04), atol=1e-15
    )


def test_pose_error_grows_away_from_where_the_pivots_were_measured() -> None:
    eye = replace(RIG120.left, pivot_sigma_m=0.3e-3, reference_depth_m=6.0)
    guessed = replace(
        RIG120, left=eye, right=replace(RIG120.right, pivot_sigma_m=0.3e-3, reference_depth_m=6.0)
    )
    expected_px = RIG120.fovea_f_px * math.sqrt(2.0) * 0.3e-3 * (1 / 2.0 - 1 / 6.0)
    mirrors_px = guessed.pose_sigma_px(6.0)
    assert guessed.pose_sigma_px(2.0) == pytest.approx(math.hypot(expected_px, mirrors_px), rel=1e-9)
    assert mirrors_px < RIG120.pose_sigma_px(2.0) * 1.01


def test_a_parked_rig_looks_about_straight_ahead() -> None:
    assert np.abs(np.rad2deg(RIG120.gaze_rad(PARKED))).max() < 0.6  # offsets of tenths of a degree
