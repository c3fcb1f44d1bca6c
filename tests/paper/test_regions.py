"""Sec. 4.4 and Fig. 7: where an observer may stand, exactly and by cells."""

import math

import numpy as np
import pytest
import shapely
from shapely.affinity import rotate
from shapely.geometry import Point, Polygon, box
from shapely.geometry.base import BaseGeometry

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.study.visibility.maps import FieldMap, RandomMap, random_map
from foveacam_pipeline.study.visibility.raster_regions import raster_areas_m2, raster_regions
from foveacam_pipeline.study.visibility.regions import (
    annulus,
    disc,
    feasible_region,
    feasible_regions,
    region_areas,
    regions_within,
    shadows,
)
from foveacam_pipeline.study.visibility.standoff import StandoffRing

BOUNDS_M = (-20.0, -20.0, 20.0, 20.0)
RING = StandoffRing(inner_m=2.0, outer_m=8.0)


def _field(*obstacles: BaseGeometry) -> FieldMap:
    outlines = tuple(Polygon(shape) for shape in obstacles if isinstance(shape, Polygon))
    assert len(outlines) == len(obstacles)
    return FieldMap(bounds_m=BOUNDS_M, obstacles=outlines, targets_m=((0.0, 0.0),))


def test_the_open_ring_has_the_area_of_the_formula() -> None:
    region = feasible_region(_field(), 0, RING, agent_radius_m=0.3)
    assert region.area == pytest.approx(RING.area_m2, rel=1e-9)
    assert disc((3.0, 4.0), 5.0).area == pytest.approx(25.0 * math.pi, rel=1e-12)


def test_a_circle_of_chords_leaves_the_circle_by_less_than_was_said() -> None:
    corners = shapely.get_coordinates(disc((0.0, 0.0), 10.0))
    middles = (corners[1:] + corners[:-1]) / 2.0
    assert np.abs(np.hypot(*np.vstack([corners, middles]).T) - 10.0).max() <= 2.1e-4 * 10.0


def test_an_empty_ring_leaves_no_place() -> None:
    region = feasible_region(_field(), 0, StandoffRing(inner_m=3.0, outer_m=3.0), agent_radius_m=0.3)
    assert region.is_empty
    assert annulus((0.0, 0.0), StandoffRing(inner_m=3.0, outer_m=2.0)).is_empty


def test_the_shadow_of_a_square_lies_between_its_tangents() -> None:
    # a wall from (3, -1) to (3, 1) hides an angle of 2 atan(1/3) beyond itself
    wall = box(3.0, -1.0, 3.5, 1.0)
    hidden = shadows(_field(wall), (0.0, 0.0), outer_m=8.0).intersection(disc((0.0, 0.0), 8.0))
    sector_m2 = 8.0**2 * math.atan(1.0 / 3.0)
    assert hidden.area == pytest.approx(sector_m2 - 3.0, rel=1e-3)  # less the triangle before the wall
    assert hidden.covers(Point(7.0, 2.3))
    assert not hidden.intersects(Point(7.0, 7.0 / 3.0 + 0.001))


def test_obstacles_beyond_the_outer_bound_hide_nothing() -> None:
    assert shadows(_field(box(9.0, -1.0, 10.0, 1.0)), (0.0, 0.0), outer_m=8.0).is_empty


def test_a_wall_close_before_the_target_hides_half_the_plane() -> None:
    hidden = shadows(_field(box(1e-3, -15.0, 1.0, 15.0)), (0.0, 0.0), outer_m=8.0)
    assert hidden.intersection(disc((0.0, 0.0), 8.0)).area == pytest.approx(32.0 * math.pi, rel=1e-3)


@pytest.mark.parametrize("turn_deg", [0.0, 37.0, 190.0])
def test_a_horseshoe_hides_what_its_parts_hide_but_not_its_mouth(turn_deg: float) -> None:
    parts = (box(3, -2, 6, -1.5), box(3, 1.5, 6, 2), box(5.5, -2, 6, 2))
    whole = shapely.union_all(list(parts))
    turned = [rotate(part, turn_deg, origin=(0, 0)) for part in (*parts, whole)]
    one = feasible_region(_field(turned[3]), 0, RING, agent_radius_m=0.2)
    three = feasible_region(_field(*turned[:3]), 0, RING, agent_radius_m=0.2)
    assert one.symmetric_difference(three).area < 1e-9
    assert one.covers(rotate(Point(4.5, 0.0), turn_deg, origin=(0, 0)))
    filled = feasible_region(_field(turned[3].convex_hull), 0, RING, agent_radius_m=0.2)
    assert one.area > filled.area + 3.0


def test_from_a_courtyard_only_the_courtyard_is_seen() -> None:
    house = box(-6, -6, 6, 6).difference(box(-3, -3, 3, 3))
    assert isinstance(house, Polygon)
    region = feasible_region(_field(house), 0, StandoffRing(inner_m=1.0, outer_m=15.0), agent_radius_m=0.5)
    assert region.area == pytest.approx(25.0 - math.pi, rel=1e-6)


def test_the_agent_keeps_its_radius_from_walls_and_obstacles_and_may_not_fit_at_all() -> None:
    field = FieldMap(bounds_m=(0.0, 0.0, 10.0, 10.0), obstacles=(box(6, 4, 7, 6),), targets_m=((5.0, 5.0),))
    region = feasible_region(field, 0, StandoffRing(inner_m=0.5, outer_m=20.0), agent_radius_m=0.4)
    assert region.distance(field.obstacles[0]) == pytest.approx(0.4, abs=2e-3)
    assert region.bounds == pytest.approx((0.4, 0.4, 9.6, 9.6))
    assert feasible_region(field, 0, RING, agent_radius_m=6.0).is_empty


def test_a_smaller_outer_bound_gives_what_computing_anew_gives() -> None:
    field = random_map(RandomMap(), seed=4)
    wide = feasible_regions(field, StandoffRing(inner_m=2.0, outer_m=8.0), agent_radius_m=0.3)
    anew = feasible_regions(field, StandoffRing(inner_m=2.0, outer_m=5.0), agent_radius_m=0.3)
    assert any(expected.area > 0.0 for expected in anew)
    for found, expected in zip(regions_within(field, wide, outer_m=5.0), anew, strict=True):
        assert found.symmetric_difference(expected).area < 1e-6


def test_areas_are_the_union_the_mean_and_the_sum() -> None:
    found = region_areas([box(0, 0, 2, 1), box(1, 0, 3, 1)])
    assert (found.multi_m2, found.single_m2, found.weighted_m2) == pytest.approx((3.0, 2.0, 4.0))


def test_exact_regions_agree_with_cells() -> None:
    field = random_map(RandomMap(obstacle_count=40, target_count=5), seed=1)
    ring = StandoffRing(inner_m=2.0, outer_m=8.0)
    regions = feasible_regions(field, ring, agent_radius_m=0.3)
    masks = raster_regions(field, ring, agent_radius_m=0.3, cell_m=0.08)
    found = region_areas(regions)
    by_cells = raster_areas_m2(masks, cell_m=0.08)
    assert by_cells == pytest.approx((found.multi_m2, found.single_m2, found.weighted_m2), rel=0.005)
    for region, mask in zip(regions, masks, strict=True):
        assert mask.sum() * 0.08**2 == pytest.approx(region.area, rel=0.005)


def test_cells_agree_on_outlines_that_are_not_convex_and_have_holes() -> None:
    horseshoe = Polygon([(3, -2), (6, -2), (6, 2), (3, 2), (3, 1.5), (5.5, 1.5), (5.5, -1.5), (3, -1.5)])
    house = box(-9, -3, -3, 3).difference(box(-8, -2, -4, 2))
    assert isinstance(house, Polygon)
    field = FieldMap(
        bounds_m=BOUNDS_M, obstacles=(horseshoe, house), targets_m=((0.0, 0.0), (-6.0, 0.5), (4.5, 0.2))
    )
    ring = StandoffRing(inner_m=0.5, outer_m=10.0)
    regions = feasible_regions(field, ring, agent_radius_m=0.25)
    masks = raster_regions(
        field, ring, agent_radius_m=0.25, cell_m=0.05
    )  # the walls, grown, lie between cells
    for region, mask in zip(regions, masks, strict=True):
        assert mask.sum() * 0.05**2 == pytest.approx(region.area, rel=0.005)


def test_what_cannot_be_is_refused_in_a_sentence() -> None:
    with pytest.raises(InvalidInput, match="target 3 was asked for; the map has 1, counted from 0"):
        feasible_region(_field(), 3, RING, agent_radius_m=0.3)
    for inner_m, outer_m in ((-1.0, 2.0), (1.0, math.inf), (math.nan, 2.0)):
        with pytest.raises(InvalidInput, match=r"a ring from .* both are numbers of 0 m or more"):
            feasible_region(_field(), 0, StandoffRing(inner_m=inner_m, outer_m=outer_m), agent_radius_m=0.3)
    with pytest.raises(InvalidInput, match="an agent of radius -1"):
        feasible_region(_field(), 0, RING, agent_radius_m=-1.0)
    with pytest.raises(InvalidInput, match="no target, so that there is nothing to observe"):
        region_areas([])
    with pytest.raises(InvalidInput, match="cells of 0"):
        raster_regions(_field(), RING, agent_radius_m=0.3, cell_m=0.0)
