"""The figures of `bench truth`: standard errors, agreement side by side, and what counts as wrong."""

import math
from dataclasses import replace

import pytest

from foveacam_bench.verge.field_clicks import JudgedClick
from foveacam_bench.verge.truth import consistent, figures, quantile
from foveacam_hardware.contract import Role
from foveacam_hardware.sim.faults import ThermalMountDrift
from foveacam_pipeline.verge.values import Alternative, Basis, DistanceBound, Fixation, FixationState
from foveacam_server.resources.studying.studies.click_truth import Click, ClickKind
from foveacam_server.resources.studying.studies.judged_clicks import ClickResult

RANGE_M = 10.0


def answer(
    error_sigmas: float | None = 0.0,
    *,
    basis: Basis = Basis.BOTH_FOVEAE,
    sigma_m: float = 0.1,
    range_m: float = RANGE_M,
    alternatives: tuple[Alternative, ...] = (),
    bound: DistanceBound | None = None,
) -> JudgedClick:
    """Return a click whose answer is off by some standard errors, or has no distance."""
    distance_m = None if error_sigmas is None else RANGE_M + error_sigmas * sigma_m
    fixation = Fixation(
        state=FixationState.VERGED,
        reason="",
        target_ax_rad=0.0,
        target_ay_rad=0.0,
        steps=(),
        distance_m=distance_m,
        distance_sigma_m=None if distance_m is None else sigma_m,
        basis=basis,
        bound=bound,
        alternatives=alternatives,
    )
    return JudgedClick(
        scene="bench",
        pixel=(700.0, 500.0),
        name="poster",
        seen_by="both",
        range_m=range_m,
        fixation=fixation,
        off_centre_px=1.0,
    )


def test_answers_agree_where_their_errors_are_within_three_standard_errors() -> None:
    assert consistent([answer(2.0), answer(-2.0)])  # 4 of one are 2.8 of a difference
    assert not consistent([answer(2.5), answer(-2.5)])
    assert consistent(
        [
            answer(2.5),
            answer(None, basis=Basis.BOUND, bound=DistanceBound(nearest_m=9.0, farthest_m=math.inf)),
        ]
    )
    assert not consistent(
        [answer(), answer(None, basis=Basis.BOUND, bound=DistanceBound(nearest_m=11.0, farthest_m=math.inf))]
    )


def test_the_quantile_is_of_one_basis() -> None:
    both = [answer(0.01 * k) for k in range(101)]
    other = [answer(5.0, basis=Basis.SURROUNDINGS)]
    assert quantile(both + other, Basis.BOTH_FOVEAE) == pytest.approx(0.68)
    assert math.isnan(quantile(both, Basis.SURROUNDINGS))


def test_a_wrong_answer_that_lists_the_truth_is_said() -> None:
    listed = tuple(
        Alternative(
            basis=Basis.SURROUNDINGS,
            distance_m=distance_m,
            distance_sigma_m=0.1,
            point_rig_m=(0.0, 0.0, distance_m),
            probability=0.5,
        )
        for distance_m in (RANGE_M, 2.0 * RANGE_M)
    )
    wrong, said, right = answer(20.0), answer(20.0, alternatives=listed), answer(1.0)
    found = figures([[wrong], [said], [right], [right, right]])
    assert (found["clicks"], found["wrong_fraction"], found["wrong_said"]) == (4, 0.25, 1)
    assert (found["clicks_inside"], found["wrong_inside_fraction"]) == (4, 0.25)
    assert (found["compared_places"], found["consistent_fraction"]) == (1, 1.0)
    assert found["sigma_within_3"] == 0.5


def test_wrong_answers_beside_an_edge_are_counted_apart() -> None:
    beside, right = replace(answer(20.0), inside=False), answer(1.0)
    found = figures([[beside], [right], [right]])
    assert found["wrong_fraction"] == pytest.approx(1 / 3)
    assert (found["clicks_inside"], found["wrong_inside_fraction"]) == (2, 0.0)


@pytest.mark.parametrize(
    ("error_sigmas", "sigma_m", "wrong"),
    [(6.0, 0.1, True), (-6.0, 0.1, True), (6.0, 0.01, False), (4.0, 0.5, False)],
)
def test_an_error_is_wrong_that_is_large_and_larger_than_was_stated(
    error_sigmas: float, sigma_m: float, wrong: bool
) -> None:
    judged = answer(error_sigmas, sigma_m=sigma_m)
    assert judged.wrong is wrong
    clicked = Click(
        scene="bench",
        x_px=700.0,
        y_px=500.0,
        t_ns=0,
        kind=ClickKind.TEXTURED,
        name="poster",
        range_m=RANGE_M,
        point_rig_m=(0.0, 0.0, RANGE_M),
    )
    of_study = ClickResult(click=clicked, fixation=judged.fixation, error_m=judged.error_m)
    assert of_study.wrong is wrong


@pytest.mark.parametrize(
    ("nearest_m", "farthest_m", "holds"),
    [(9.0, 11.0, True), (9.0, math.inf, True), (5.0, 9.0, False), (11.0, 12.0, False)],
)
def test_a_bound_holds_where_the_truth_is_between_its_ends(
    nearest_m: float, farthest_m: float, holds: bool
) -> None:
    bound = DistanceBound(nearest_m=nearest_m, farthest_m=farthest_m)
    assert answer(None, basis=Basis.BOUND, bound=bound).bound_holds is holds


def test_a_distance_of_the_background_is_wrong_unless_it_reaches_to_infinity() -> None:
    assert answer(0.0, range_m=math.inf).wrong
    assert not answer(0.0, range_m=math.inf, sigma_m=3.0).wrong


def test_mounts_begin_to_drift_when_they_are_told_to() -> None:
    drift = ThermalMountDrift(seed=3, zero_s=200.0)
    assert drift.turn_rad(Role.LEFT, 200.0).tolist() == [0.0, 0.0]
    since_start = ThermalMountDrift(seed=3)
    turned = since_start.turn_rad(Role.LEFT, 350.0) - since_start.turn_rad(Role.LEFT, 200.0)
    assert drift.turn_rad(Role.LEFT, 350.0) == pytest.approx(turned)
