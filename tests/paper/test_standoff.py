"""Sec. 4.4.1 and 4.4.2: the ring of stand-off places, and lines of sight among random obstacles."""

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest
from tests.support.scenes.obstacle_quadrature import success_by_quadrature

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.study.visibility.obstacles import (
    RandomObstacles,
    clear_probability,
    corridor_m2,
    sample_success,
    success_probability,
    success_slope_per_m,
)
from foveacam_pipeline.study.visibility.standoff import (
    NearBound,
    StandoffRing,
    resolution_rad,
    resolving_range_m,
    standoff_ring,
)

DOMAIN_M2 = 3000.0
RINGS = (
    StandoffRing(inner_m=5.0, outer_m=10.0),
    StandoffRing(inner_m=2.0, outer_m=20.0),
    StandoffRing(inner_m=0.0, outer_m=12.0),
)
CLUTTERS = tuple(
    RandomObstacles(occupancy=p, radius_m=r_m)
    for p, r_m in itertools.product((0.0, 0.01, 0.05, 0.3), (0.1, 0.4))
)
SETTINGS = list(itertools.product(RINGS, CLUTTERS))


def test_a_feature_is_resolved_as_far_as_it_fills_a_pixel_of_the_fovea() -> None:
    fovea, wide = resolution_rad(502.0), resolution_rad(55.0)  # Table 2
    assert resolving_range_m(0.001, fovea) == pytest.approx(28.76, abs=0.01)
    assert resolving_range_m(0.001, fovea) / resolving_range_m(0.001, wide) == pytest.approx(
        502 / 55, rel=1e-4
    )
    assert resolving_range_m(0.01, 0.3, small_angle=True) == pytest.approx(0.01 / 0.3)
    assert resolving_range_m(0.01, 0.3) < resolving_range_m(0.01, 0.3, small_angle=True)
    assert resolving_range_m(0.01, 1e-4) == pytest.approx(
        resolving_range_m(0.01, 1e-4, small_angle=True), rel=1e-8
    )


def test_area_of_the_ring_grows_with_the_squares_of_its_bounds() -> None:
    assert standoff_ring(5.0, 10.0).area_m2 == pytest.approx(math.pi * 75.0)
    assert not standoff_ring(5.0, 10.0).empty


@pytest.mark.parametrize("d_max_m", [5.0, 4.0])
def test_who_is_seen_as_far_as_it_sees_has_no_place(d_max_m: float) -> None:
    assert standoff_ring(5.0, d_max_m).empty
    assert standoff_ring(5.0, d_max_m).area_m2 == 0.0
    assert success_probability(standoff_ring(5.0, d_max_m), CLUTTERS[3], domain_m2=DOMAIN_M2) == 0.0


def test_the_depth_error_moves_the_inner_bound_either_way() -> None:
    assert standoff_ring(5.0, 10.0, near_error_m=0.5).inner_m == 5.5
    assert standoff_ring(5.0, 10.0, near_error_m=0.5, bound=NearBound.AS_PRINTED).inner_m == 4.5
    assert standoff_ring(5.0, 10.0, near_error_m=0.5, bound=NearBound.PLAIN).inner_m == 5.0
    assert standoff_ring(0.2, 10.0, near_error_m=0.5, bound=NearBound.AS_PRINTED).inner_m == 0.0


def test_the_corridor_is_a_stadium() -> None:
    assert corridor_m2(0.0, 0.5) == pytest.approx(math.pi * 0.25)
    assert corridor_m2([10.0], 0.5)[0] == pytest.approx(10.0 + math.pi * 0.25)
    assert clear_probability(10.0, RandomObstacles(occupancy=0.1, radius_m=0.5)) == pytest.approx(
        0.9 ** (10 + math.pi / 4)
    )


@pytest.mark.parametrize(("around", "clutter"), SETTINGS)
def test_closed_form_quadrature_and_lot_agree(around: StandoffRing, clutter: RandomObstacles) -> None:
    exact = success_probability(around, clutter, domain_m2=DOMAIN_M2)
    assert success_by_quadrature(around, clutter, domain_m2=DOMAIN_M2) == pytest.approx(
        exact, rel=1e-8, abs=1e-15
    )
    drawn = sample_success(
        around,
        clutter,
        domain_m2=DOMAIN_M2,
        trials=40_000,
        rng=np.random.default_rng([7, SETTINGS.index((around, clutter))]),
    )
    sigma = math.sqrt(exact * (1.0 - exact) / drawn.trials)
    assert abs(drawn.value - exact) <= 3.0 * sigma


@pytest.mark.parametrize("clutter", CLUTTERS)
def test_the_slope_is_the_derivative_and_never_negative(clutter: RandomObstacles) -> None:
    step_m = 1e-4
    beyond, before = (
        success_probability(
            StandoffRing(inner_m=5.0, outer_m=15.0 + way * step_m), clutter, domain_m2=DOMAIN_M2
        )
        for way in (1.0, -1.0)
    )
    slope = success_slope_per_m(15.0, clutter, domain_m2=DOMAIN_M2)
    assert slope == pytest.approx((beyond - before) / (2.0 * step_m), rel=1e-6, abs=1e-12)
    assert slope >= 0.0


def test_the_closed_form_holds_where_there_is_almost_nothing_and_where_all_is_full() -> None:
    empty = success_probability(RINGS[0], RandomObstacles(occupancy=0.0, radius_m=0.3), domain_m2=DOMAIN_M2)
    sparse = success_probability(
        RINGS[0], RandomObstacles(occupancy=1e-13, radius_m=0.3), domain_m2=DOMAIN_M2
    )
    assert sparse == pytest.approx(empty, rel=1e-9)
    assert (
        success_probability(RINGS[0], RandomObstacles(occupancy=1.0, radius_m=0.3), domain_m2=DOMAIN_M2)
        == 0.0
    )
    points = RandomObstacles(occupancy=1.0, radius_m=0.0)  # of no size: they hide nothing
    assert success_probability(RINGS[0], points, domain_m2=DOMAIN_M2) == pytest.approx(empty)


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (
            lambda: RandomObstacles(occupancy=1.2, radius_m=0.3),
            "an occupancy p of 1.2 was given; a probability is 0 to 1",
        ),
        (lambda: RandomObstacles(occupancy=math.nan, radius_m=0.3), "an occupancy p of nan"),
        (lambda: RandomObstacles(occupancy=0.2, radius_m=-1.0), "an obstacle radius of -1.0 m"),
        (lambda: resolving_range_m(0.0, 1e-3), "a feature of 0.0 m was given"),
        (lambda: resolving_range_m(0.1, 4.0), "an angular resolution of 4.0 rad"),
        (lambda: resolution_rad(0.0), "0.0 px per degree"),
        (lambda: standoff_ring(-1.0, 2.0), "D_min of -1.0 m"),
        (lambda: standoff_ring(1.0, math.nan), "D_max of nan m"),
        (lambda: success_probability(RINGS[0], CLUTTERS[0], domain_m2=100.0), "needs more than 314"),
        (
            lambda: sample_success(
                RINGS[0],
                RandomObstacles(occupancy=1.0, radius_m=0.1),
                domain_m2=DOMAIN_M2,
                trials=9,
                rng=np.random.default_rng(),
            ),
            "an occupancy of 1 fills the plane",
        ),
    ],
)
def test_what_is_impossible_is_refused_in_a_sentence(ask: Callable[[], object], words: str) -> None:
    with pytest.raises(InvalidInput, match=words):
        ask()
