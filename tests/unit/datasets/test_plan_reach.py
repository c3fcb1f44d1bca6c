"""Plans against a rig: filled in from its calibration, refused where it cannot look or stand."""

import math

import numpy as np
import pytest

from foveacam_hardware.contract import InvalidInput, OutOfRange, RailLimits
from foveacam_pipeline.capture.plan import (
    GridPoints,
    PlanPoint,
    RasterPlan,
    all_point_volts,
    average_distance_m,
    check_plan,
    check_rail,
    fill_in_plan,
    gazes_rad,
    largest_field_deg,
    plan_from,
    point_volts,
    points_of_plan,
    survey_directions_rad,
)
from foveacam_pipeline.capture.plan.plan_field import beyond_hull_rad
from foveacam_pipeline.geometry import point_from_direction
from foveacam_pipeline.models import load_calibration
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED

PAPER_RAIL_MM = (-300.0, -100.0, 0.0, 100.0, 300.0)

RIG120 = load_calibration(SHIPPED / "sim-rig120.json")
RAIL = RailLimits(min_m=-0.3, max_m=0.3)


def grid(half_width_deg: float, half_height_deg: float, *, distance_m: float = 5.0) -> RasterPlan:
    return plan_from(
        {
            "points": {"kind": "grid", "half_width_deg": half_width_deg, "half_height_deg": half_height_deg},
            "verging": {"mode": "given", "distance_m": distance_m},
        }
    )


@pytest.mark.parametrize("average_m", [math.inf, 10.0, 2.0])
def test_an_empty_plan_is_filled_in_and_within_reach(average_m: float) -> None:
    plan = fill_in_plan(RasterPlan(), RIG120, average_m=average_m)
    check_plan(plan, RIG120, rail=None)
    assert len(points_of_plan(plan)) == 81
    assert {point.distance_m for point in points_of_plan(plan)} == {average_m}
    assert fill_in_plan(plan, RIG120, average_m=3.0) == plan  # what is filled in stays


@pytest.mark.parametrize("distance_m", [math.inf, 4.0, 1.5])
def test_the_field_is_as_large_as_the_calibration_allows(distance_m: float) -> None:
    width_deg, height_deg = largest_field_deg(RIG120, distance_m)

    def reached(more_deg: float, higher_deg: float) -> bool:
        plan = fill_in_plan(
            RasterPlan(
                points=GridPoints(
                    half_width_deg=width_deg + more_deg, half_height_deg=height_deg + higher_deg
                )
            ),
            RIG120,
            average_m=distance_m,
        )
        try:
            check_plan(plan, RIG120, rail=None)
        except OutOfRange:
            return False
        return True

    assert reached(0.0, 0.0)
    assert not reached(0.15, 0.0)  # the field is sought in steps of 0.1°, the domain has a margin of 0.05°
    assert not reached(0.0, 0.9)  # higher it may be where it is narrower


def test_a_near_scene_narrows_the_field_by_the_eyes_turning_inwards() -> None:
    far, near = largest_field_deg(RIG120, math.inf), largest_field_deg(RIG120, 2.0)
    assert far[0] - near[0] == pytest.approx(math.degrees(math.atan(0.1 / 2.0)), abs=0.2)


def test_a_centre_beyond_reach_has_no_field() -> None:
    with pytest.raises(OutOfRange, match="no field about ax 20°, ay 0° is within reach of both eyes at 5 m"):
        largest_field_deg(RIG120, 5.0, centre_deg=(20.0, 0.0))


def test_a_plan_beyond_reach_is_refused_by_point_and_angle() -> None:
    with pytest.raises(OutOfRange) as refused:
        check_plan(grid(9.0, 7.0), RIG120, rail=None)
    words = str(refused.value)
    assert "point 0 (column 0, row 0; ax -9.00°, ay -7.00°, at 5 m) needs the right eye at ax -10.1" in words
    assert "beyond its calibrated field" in words and "of 81 points" in words
    assert "at 5 m the grid may be ±7.5° x ±7.6°" in words


def test_how_far_beyond_is_the_distance_to_the_field() -> None:
    mirror = RIG120.left.mirror
    rightmost = mirror.hull_rad[np.argmax(mirror.hull_rad[:, 0])]
    outside = rightmost + np.deg2rad([[0.5, 0.0]])
    assert math.degrees(float(beyond_hull_rad(mirror, outside)[0])) == pytest.approx(0.5, abs=0.01)
    assert float(beyond_hull_rad(mirror, np.zeros((1, 2)))[0]) < -math.radians(7.0)


def test_a_set_point_out_of_reach_is_named() -> None:
    plan = plan_from({"points": {"kind": "set_points", "points": "0, 0, 5\n12, 0, 5\n"}})
    with pytest.raises(OutOfRange, match=r"point 1 \(column 1, row 0; ax 12.00°.*move these points"):
        check_plan(plan, RIG120, rail=None)
    near = plan_from({"points": {"kind": "set_points", "points": "0, 0, 0.05\n"}})
    with pytest.raises(OutOfRange, match="point 0 "):
        check_plan(near, RIG120, rail=None)


def test_both_eyes_meet_on_a_point_and_part_by_the_shift() -> None:
    point = PlanPoint(
        index=0, scan=0, point=0, column=0, row=0, ax_rad=0.05, ay_rad=-0.03, distance_m=4.0, shift_rad=0.002
    )
    left, right = gazes_rad(point, RIG120)
    level = gazes_rad(
        PlanPoint(index=0, scan=0, point=0, column=0, row=0, ax_rad=0.05, ay_rad=-0.03, distance_m=4.0),
        RIG120,
    )
    assert left == (level[0][0], level[0][1] + 0.002) and right == (level[1][0], level[1][1] - 0.002)
    met = RIG120.meeting(RIG120.steer(0.05, -0.03, distance_m=4.0))
    np.testing.assert_allclose(met.point_m, point_from_direction(0.05, -0.03, 4.0), atol=1e-8)


def test_all_points_steered_at_once_get_the_volts_of_each_alone() -> None:
    sequence = points_of_plan(grid(5.0, 4.0))[::20]
    for point, volts in zip(sequence, all_point_volts(sequence, RIG120), strict=True):
        alone = point_volts(point, RIG120)
        assert volts.left.x_v == pytest.approx(alone.left.x_v, abs=1e-6)
        assert volts.right.y_v == pytest.approx(alone.right.y_v, abs=1e-6)
    assert all_point_volts((), RIG120) == ()


def test_points_beyond_reach_are_not_steered() -> None:
    with pytest.raises(OutOfRange, match=r"point 0 .*beyond the calibrated field"):
        all_point_volts(points_of_plan(grid(9.0, 9.0)), RIG120)


def test_a_rail_that_is_not_there_is_refused() -> None:
    with pytest.raises(OutOfRange, match="5 places on the rail were asked, this rig has no rail"):
        check_rail(RasterPlan(rail_positions_mm=PAPER_RAIL_MM), None)


def test_a_place_beyond_the_rail_is_refused_by_how_far() -> None:
    check_rail(RasterPlan(rail_positions_mm=PAPER_RAIL_MM), RAIL)
    with pytest.raises(OutOfRange, match=r"place 1 of the rail, 320 mm, is 20 mm beyond its end"):
        check_rail(RasterPlan(rail_positions_mm=(0.0, 320.0)), RAIL)
    with pytest.raises(OutOfRange, match=r"place 0 of the rail, -330 mm, is 30 mm beyond its end"):
        check_rail(RasterPlan(rail_positions_mm=(-330.0, 0.0)), RAIL)


def test_a_scenes_distance_is_averaged_where_disparity_is() -> None:
    assert average_distance_m([2.0, None, 6.0]) == pytest.approx(3.0)
    assert average_distance_m([4.0, math.inf]) == pytest.approx(8.0)
    assert average_distance_m([math.inf]) == math.inf


@pytest.mark.parametrize("distances_m", [[], [None, None], [3.0, math.nan], [-1.0]])
def test_a_distance_that_nobody_measured_is_refused(distances_m: list[float | None]) -> None:
    with pytest.raises(InvalidInput, match="average distance"):
        average_distance_m(distances_m)
    with pytest.raises(InvalidInput, match="average distance is needed, None was given"):
        fill_in_plan(RasterPlan(), RIG120)


def test_the_survey_looks_over_the_middle_of_the_field() -> None:
    directions = np.rad2deg(survey_directions_rad(grid(6.0, 3.0), RIG120))
    np.testing.assert_allclose(np.unique(directions[:, 0]), [-4.0, 0.0, 4.0], atol=1e-9)
    np.testing.assert_allclose(np.unique(directions[:, 1]), [-2.0, 0.0, 2.0], atol=1e-9)
    unknown = survey_directions_rad(RasterPlan(), RIG120)
    assert unknown.shape == (9, 2)
    assert RIG120.left.mirror.inside(unknown).all() and RIG120.right.mirror.inside(unknown).all()
    one = plan_from({"points": {"kind": "set_points", "points": "3, 1"}})
    np.testing.assert_allclose(np.rad2deg(survey_directions_rad(one, RIG120)), [[3.0, 1.0]])
