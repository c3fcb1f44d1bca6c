"""Sec. 4.4.3: plans of the ground, given and drawn by lot."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import shapely
from shapely.geometry import Point, Polygon, box

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.study.visibility.maps import FieldMap, RandomMap, random_map

BOUNDS_M = (0.0, 0.0, 10.0, 8.0)
BOW_TIE = Polygon([(2, 2), (4, 4), (4, 2), (2, 4)])


def test_a_map_is_the_same_for_its_seed_and_another_for_another() -> None:
    settings = RandomMap()
    assert random_map(settings, seed=(5, 1)) == random_map(settings, seed=(5, 1))
    assert random_map(settings, seed=(5, 1)) != random_map(settings, seed=(5, 2))


@pytest.mark.parametrize("seed", range(8))
def test_a_random_map_keeps_every_clearance_that_was_asked_for(seed: int) -> None:
    settings = RandomMap(obstacle_count=40, target_count=5)
    found = random_map(settings, seed=seed)
    assert len(found.targets_m) == 5
    assert 30 <= len(found.obstacles) <= 40  # a few lie beyond the bounds by their cut outlines only
    for index, target_m in enumerate(found.targets_m):
        assert min(*target_m, *(np.array(found.size_m) - target_m)) >= settings.edge_m
        others = found.targets_m[:index]
        assert all(math.dist(target_m, other) >= settings.target_gap_m for other in others)
        clear_m = settings.target_clear_m + settings.agent_radius_m
        assert all(obstacle.distance(Point(target_m)) >= clear_m for obstacle in found.obstacles)
    assert all(found.area.covers(obstacle) for obstacle in found.obstacles)


def test_a_density_draws_a_poisson_number_of_obstacles() -> None:
    settings = RandomMap(obstacles_per_m2=0.01, size_m=(100.0, 40.0), target_count=1)
    counts = [len(random_map(settings, seed=seed).obstacles) for seed in range(40)]
    mean = 0.01 * 100.0 * 40.0
    assert abs(np.mean(counts) - mean) < 4.0 * math.sqrt(mean / len(counts))
    assert len(set(counts)) > 5


def test_obstacles_beyond_the_bounds_are_cut_at_them() -> None:
    horseshoe = Polygon([(8, 1), (13, 1), (13, 6), (8, 6), (8, 5), (12, 5), (12, 2), (8, 2)])
    found = FieldMap(bounds_m=BOUNDS_M, obstacles=(box(-2, -2, 1, 1), box(20, 20, 21, 21), horseshoe))
    assert [obstacle.area for obstacle in found.obstacles] == pytest.approx([1.0, 2.0, 2.0])
    assert shapely.union_all(list(found.obstacles)).within(found.area)


def test_a_courtyard_may_hold_a_target() -> None:
    house = box(2, 2, 6, 6).difference(box(3, 3, 5, 5))
    assert isinstance(house, Polygon)
    found = FieldMap(bounds_m=BOUNDS_M, obstacles=(house,), targets_m=((4.0, 4.0),))
    assert len(found.obstacles[0].interiors) == 1


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda: FieldMap(bounds_m=(0.0, 0.0, 0.0, 5.0)), "with x0 < x1 and y0 < y1"),
        (lambda: FieldMap(bounds_m=(0.0, 0.0, math.nan, 5.0)), "bounds of"),
        (
            lambda: FieldMap(bounds_m=BOUNDS_M, obstacles=(box(0, 0, 1, 1), BOW_TIE)),
            r"obstacle 1 is no simple polygon \(Self-intersection\[3 3\]\); draw its outline",
        ),
        (lambda: FieldMap(bounds_m=BOUNDS_M, obstacles=(Polygon(),)), "obstacle 0 has no outline"),
        (
            lambda: FieldMap(bounds_m=BOUNDS_M, targets_m=((1.0, 1.0), (10.5, 2.0))),
            r"target 1 at \(10.5, 2\) m is outside the map, x 0 to 10 and y 0 to 8 m; move it inside",
        ),
        (lambda: FieldMap(bounds_m=BOUNDS_M, targets_m=((math.nan, 2.0),)), "target 0 .* is outside the map"),
        (
            lambda: FieldMap(bounds_m=BOUNDS_M, obstacles=(box(1, 1, 3, 3),), targets_m=((2.0, 2.0),)),
            r"target 0 at \(2, 2\) m is inside obstacle 0 or on its edge; move the target or the obstacle",
        ),
        (
            lambda: FieldMap(bounds_m=BOUNDS_M, obstacles=(box(1, 1, 3, 3),), targets_m=((3.0, 2.0),)),
            "or on its edge",
        ),
        (lambda: RandomMap(radii_m=(2.0, 1.0)), "radii from 2.0 to 1.0"),
        (lambda: RandomMap(corners=(2, 5)), "obstacles of 2 corners"),
        (lambda: RandomMap(target_count=-1), "fewer than no obstacles or targets"),
        (lambda: RandomMap(edge_m=20.0), "twice the edge less than either side"),
        (lambda: random_map(RandomMap(target_gap_m=30.0), seed=1), "4 targets 30.0 m apart find no room"),
        (
            lambda: random_map(replace(RandomMap(), radii_m=(60.0, 60.0)), seed=1),
            "an obstacle of radius 60.00 m finds no room",
        ),
    ],
)
def test_a_map_that_cannot_be_is_refused_by_name_with_the_remedy(
    ask: Callable[[], object], words: str
) -> None:
    with pytest.raises(InvalidInput, match=words):
        ask()
