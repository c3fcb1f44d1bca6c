"""Looks at a border are planned by what they can still change."""

import numpy as np
import pytest

from foveacam_pipeline.verge.surroundings.border_depth import BorderDepth
from foveacam_pipeline.verge.surroundings.infer import InferredDepth
from foveacam_pipeline.verge.surroundings.look_plan import LEVELS_PER_M, LookPlan, gain_of

TARGET = np.zeros(2)
PLACES = [0.05 * np.array(way) for way in ((1.0, 0.0), (0.0, 1.2), (-1.4, 0.0), (0.0, -1.6))]


def _inferred(inverse_z_per_m: float, sigma_per_m: float) -> tuple[InferredDepth, ...]:
    one = InferredDepth(
        inverse_z_per_m=inverse_z_per_m,
        sigma_per_m=sigma_per_m,
        probability=1.0,
        samples=4,
        owned=False,
        held=True,
    )
    return (one,)


def _found(index: int, *, by_both: bool = True) -> dict[int, BorderDepth]:
    x, y = PLACES[index].tolist()
    depth = BorderDepth(
        tangents=(x, y), inverse_z_per_m=0.2, sigma_per_m=1e-3, score=0.95, by_both=by_both, beyond=None
    )
    return {index: depth}


def test_looks_go_to_the_nearest_side_that_was_not_seen_at_the_depth_that_is_believed() -> None:
    plan = LookPlan(TARGET, PLACES)

    planned = plan.next_look(_found(0), _inferred(0.31, 1e-3))

    assert planned is not None
    assert planned[0] == pytest.approx(PLACES[1])
    assert planned[1] == 0.31


def test_where_nothing_is_known_a_side_is_looked_at_in_turn_at_all_depths() -> None:
    plan = LookPlan(TARGET, PLACES)

    first, second, third = (plan.next_look({}, ()) for _ in range(3))

    assert first is not None and second is not None and third is not None
    assert [first[1], second[1]] == list(LEVELS_PER_M)
    assert (first[0] == second[0]).all()
    assert (third[0] != first[0]).any()


def test_a_side_that_both_eyes_measured_is_not_looked_at_again() -> None:
    plan = LookPlan(TARGET, PLACES)
    plan.next_look({}, ())

    planned = plan.next_look(_found(0), ())

    assert planned is not None
    assert planned[0] == pytest.approx(PLACES[1])


@pytest.mark.parametrize(("sigma_per_m", "most"), [(1e-3, 2), (0.05, 4)])
def test_looks_end_when_they_change_nothing_sooner_where_the_answer_is_sure(
    sigma_per_m: float, most: int
) -> None:
    plan, answer, looks = LookPlan(TARGET, PLACES), _inferred(0.2, sigma_per_m), 0

    while plan.next_look({}, answer) is not None:
        plan.note_gain(answer, answer)
        looks += 1

    assert looks == most


def test_a_look_that_changed_the_answer_is_followed_by_another() -> None:
    plan = LookPlan(TARGET, PLACES)
    before, after = _inferred(0.2, 4e-3), _inferred(0.2, 2e-3)
    for _ in range(2):
        plan.next_look({}, before)
        plan.note_gain(before, before)

    plan.note_gain(before, after)

    assert plan.next_look({}, after) is not None


def test_a_gain_is_a_smaller_error_or_an_answer_that_moved() -> None:
    before = _inferred(0.2, 4e-3)

    assert gain_of(before, before) == 0.0
    assert gain_of(before, _inferred(0.2, 1e-3)) == pytest.approx(0.75)
    assert gain_of(before, _inferred(0.202, 4e-3)) == pytest.approx(0.5)
    assert gain_of(before, _inferred(0.3, 8e-3)) == 1.0
    assert gain_of((), before) == 1.0
    assert gain_of((), ()) == 0.0
