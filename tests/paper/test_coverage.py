"""Sec. 4.4.3, Eq. 14: the loop about the targets and what is seen from it."""

import math
from collections.abc import Callable

import pytest
import shapely
from shapely.geometry import LinearRing, Polygon, box

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.study.visibility.coverage import CLEARANCE_M, closed_path, coverage
from foveacam_pipeline.study.visibility.maps import FieldMap, PlanPoint, RandomMap, random_map
from foveacam_pipeline.study.visibility.regions import feasible_regions
from foveacam_pipeline.study.visibility.standoff import StandoffRing

BOUNDS_M = (-20.0, -20.0, 20.0, 20.0)


def _field(*targets_m: PlanPoint, obstacles: tuple[Polygon, ...] = ()) -> FieldMap:
    return FieldMap(bounds_m=BOUNDS_M, obstacles=obstacles, targets_m=targets_m)


def _path(field: FieldMap) -> LinearRing:
    return closed_path(field, inner_m=2.0, agent_radius_m=0.3, margin_m=0.1)


def test_around_one_target_the_loop_is_a_circle_and_sees_it_all_the_way() -> None:
    field = _field((1.0, 2.0))
    path = _path(field)
    assert path.length == pytest.approx(2.0 * math.pi * 2.1, rel=1e-3)
    found = coverage(
        path, feasible_regions(field, StandoffRing(inner_m=2.0, outer_m=3.0), agent_radius_m=0.3)
    )
    assert (found.multi, found.single_any, found.single_fixed) == pytest.approx((1.0, 1.0, 1.0))


def test_two_targets_count_twice_where_both_are_seen() -> None:
    # the loop of two targets 4 m apart: half circles of 2.1 m and straights of 4 m
    field = _field((-2.0, 0.0), (2.0, 0.0))
    path = _path(field)
    length_m = 2.0 * math.pi * 2.1 + 8.0
    assert path.length == pytest.approx(length_m, rel=1e-3)
    found = coverage(
        path, feasible_regions(field, StandoffRing(inner_m=2.0, outer_m=2.9), agent_radius_m=0.3)
    )
    # 2.9² = 2² + 2.1²: either is in reach as far as the middle of the straights
    in_reach_m = math.pi * 2.1 + 2.0 * 2.0
    assert found.single_any == pytest.approx(1.0, abs=2e-3)
    assert found.multi == pytest.approx(2.0 * in_reach_m / length_m, rel=2e-3)
    assert found.single_fixed == pytest.approx(in_reach_m / length_m, rel=2e-3)
    all_seen = coverage(
        path, feasible_regions(field, StandoffRing(inner_m=2.0, outer_m=7.0), agent_radius_m=0.3)
    )
    assert (all_seen.multi, all_seen.single_any, all_seen.single_fixed) == pytest.approx((2.0, 1.0, 1.0))


def test_an_obstacle_hides_the_part_of_the_loop_in_its_shadow() -> None:
    wall = box(-0.5, 1.0, 0.5, 1.2)
    field = _field((0.0, 0.0), obstacles=(wall,))
    found = coverage(
        _path(field), feasible_regions(field, StandoffRing(inner_m=2.0, outer_m=3.0), agent_radius_m=0.3)
    )
    assert found.multi == pytest.approx(1.0 - 2.0 * math.atan(0.5) / (2.0 * math.pi), abs=2e-3)


@pytest.mark.parametrize("seed", range(6))
def test_the_loop_meets_no_obstacle_and_no_stealth_bound_and_has_every_target_inside(seed: int) -> None:
    field = random_map(RandomMap(obstacle_count=40), seed=(11, seed))
    path = _path(field)
    assert path.is_simple
    assert path.is_closed
    assert min(obstacle.distance(path) for obstacle in field.obstacles) >= 0.3 + CLEARANCE_M / 2.0
    assert path.distance(shapely.MultiPoint(field.targets_m)) >= 2.0
    assert Polygon(path).covers(shapely.MultiPoint(field.targets_m))
    assert field.area.buffer(-0.3).covers(path)


def test_an_obstacle_in_the_way_is_passed_outside() -> None:
    beyond, near = box(-9.0, -1.0, -8.0, 1.0), box(2.2, -1.0, 6.0, 1.0)
    around = Polygon(_path(_field((0.0, 0.0), obstacles=(beyond, near))))
    assert around.covers(near)
    assert not around.intersects(beyond)  # it is not in the way


def test_an_obstacle_that_reaches_the_wall_is_passed_inside() -> None:
    wall = box(-0.5, 1.9, 0.5, 20.0)
    around = Polygon(_path(_field((-3.0, 0.0), (3.0, 0.0), obstacles=(wall,))))
    assert not around.intersects(wall)
    assert around.area < 4.2 * 6.0 + math.pi * 2.1**2


def test_obstacles_that_join_the_wall_to_a_stealth_bound_leave_no_loop() -> None:
    chain = (box(4.0, -1.0, 20.0, 1.0), box(1.6, -1.0, 4.0, 1.0))
    with pytest.raises(InvalidInput, match="no loop leads around the targets 2 m away from each"):
        _path(_field((0.0, 0.0), obstacles=chain))


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda: _path(_field()), "a map without targets was given"),
        (lambda: _path(_field((19.0, 0.0))), "no loop leads around the targets 2 m away"),
        (
            lambda: closed_path(_field((0.0, 0.0)), inner_m=0.0, agent_radius_m=0.3),
            "a stealth bound of 0.0 m",
        ),
        (lambda: coverage(_path(_field((0.0, 0.0))), ()), "no target, so that nothing can be covered"),
    ],
)
def test_where_there_is_no_loop_a_sentence_says_why(ask: Callable[[], object], words: str) -> None:
    with pytest.raises(InvalidInput, match=words):
        ask()
