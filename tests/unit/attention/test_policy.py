from dataclasses import replace

import numpy as np
import pytest
from tests.support.scenes.plane_head import CALIBRATION
from tests.unit.attention.states import unknown_state

from foveacam_hardware.contract import Role
from foveacam_pipeline.attention.field import FieldGrid, Yields
from foveacam_pipeline.attention.looks import Candidates
from foveacam_pipeline.attention.losses import Weights
from foveacam_pipeline.attention.policy import AttentionPolicy, match_chance, weighted_medians
from foveacam_pipeline.verge.aim import EYES, reachable_eyes

GRID = FieldGrid.of(CALIBRATION.wide, context_cell_px=8)
CANDIDATES = Candidates(CALIBRATION, GRID)
MAP = Weights(map=1.0)
NEAR_PER_M, FAR_PER_M = 1.0 / 2.5, 1.0 / 25.0


def mapping(**more: object) -> AttentionPolicy:
    return AttentionPolicy(CANDIDATES, MAP, **more)  # type: ignore[arg-type]  # its own fields


def test_near_things_are_looked_at_by_each_eye_on_its_own() -> None:
    """One fovea and the wide camera measure them well enough, so two views show twice as much."""
    look = mapping().choose(unknown_state(len(GRID), inverse_z=NEAR_PER_M))
    assert look is not None
    assert look.meeting_m is None
    left, right = (
        CANDIDATES.shows(role, look.gazes.eye(role)[None], np.full(len(GRID), NEAR_PER_M))[0] for role in EYES
    )
    assert not (left & right).any()
    assert (look.cells == (left | right)).all()
    assert reachable_eyes(CALIBRATION, look.gazes) == set(EYES)


def test_far_things_are_looked_at_by_both_eyes_at_their_distance() -> None:
    look = mapping().choose(unknown_state(len(GRID), inverse_z=FAR_PER_M))
    assert look is not None
    assert look.meeting_m == pytest.approx(25.0, rel=0.01)
    assert "25" in look.reason
    assert "unknown" in look.reason


def test_of_two_kinds_of_looks_the_one_that_brought_more_is_preferred() -> None:
    near = unknown_state(len(GRID), inverse_z=NEAR_PER_M)
    look = mapping().choose(replace(near, yields=Yields(apart=0.2, verged=1.0)))
    assert look is not None
    assert look.meeting_m is not None


def test_a_field_that_is_known_needs_no_look() -> None:
    known = replace(unknown_state(len(GRID)), relative_sigma=np.full((len(GRID), 9), 0.001))
    assert mapping().choose(known) is None


def test_a_blank_field_is_not_looked_at_for_its_depth() -> None:
    blank = replace(unknown_state(len(GRID)), contrast=np.zeros(len(GRID)))
    assert mapping(least_worth=3.0).choose(blank) is None


@pytest.mark.parametrize("inverse_z", [NEAR_PER_M, FAR_PER_M])
def test_what_is_forbidden_is_shown_to_neither_eye_at_whatever_distance_it_is(inverse_z: float) -> None:
    forbidden = GRID.cells_in(560.0, 400.0, 300.0, 250.0)
    policy = mapping(forbidden=forbidden)
    state = unknown_state(len(GRID), inverse_z=inverse_z)
    looks = policy.plan(state, 40)
    assert len(looks) > 15
    shown = np.zeros(len(GRID), dtype=np.bool_)
    for look in looks:
        for q in (0.0, inverse_z):
            for role in EYES:
                gaze = look.gazes.eye(role)[None]
                shown |= CANDIDATES.shows(role, gaze, np.full(len(GRID), q), whole=True)[0]
    assert not (shown & forbidden).any()


def test_a_change_draws_a_look_to_it() -> None:
    known = replace(unknown_state(len(GRID)), relative_sigma=np.full((len(GRID), 9), 0.001))
    changed = GRID.cells_in(700.0, 300.0, 60.0, 60.0)
    state = replace(known, changed=changed.astype(np.float64))
    look = AttentionPolicy(CANDIDATES, Weights(map=1.0, change=5.0)).choose(state)
    assert look is not None
    assert (look.cells & changed).sum() == changed.sum()
    assert "changed" in look.reason
    assert AttentionPolicy(CANDIDATES, MAP).choose(state) is None


def test_a_plan_goes_on_to_what_is_not_shown_yet_and_to_less_and_less() -> None:
    looks = mapping().plan(unknown_state(len(GRID)), 5)
    assert len(looks) == 5
    worths = [look.worth for look in looks]
    assert worths == sorted(worths, reverse=True)
    first, second = looks[0].cells, looks[1].cells
    assert (first & second).sum() < 0.2 * min(first.sum(), second.sum())


def test_cells_that_looks_left_as_they_were_are_tried_less() -> None:
    state = unknown_state(3)
    tried = replace(state, contrast=np.array([0.0, 3.0, 3.0]), tries=np.array([0, 0, 3]))
    blank, fresh, left = match_chance(tried)
    assert blank < 0.05
    assert fresh == pytest.approx(0.9)
    assert left < 0.05


def test_a_state_after_a_look_holds_what_the_look_was_expected_to_bring() -> None:
    state = replace(unknown_state(3), changed=np.ones(3), urgency=np.ones(3), interest=np.ones(3))
    cells, measured = np.array([True, True, False]), np.array([True, False, False])
    then = state.after(cells, relative_sigma=np.full(3, 0.005), measured=measured)
    assert then.relative_sigma[:, 0].tolist() == [0.005, np.inf, np.inf]
    assert then.tries.tolist() == [0, 1, 0]
    assert then.changed.tolist() == [0.0, 0.0, 1.0]
    assert then.interest.tolist() == [0.0, 1.0, 1.0]
    assert then.looked_s.tolist() == [100.0, 100.0, -np.inf]


def test_a_weighted_median_is_the_value_that_halves_the_weight() -> None:
    weights = np.array([[1.0, 1.0, 1.0], [0.0, 0.1, 5.0], [5.0, 0.1, 0.0]])
    assert weighted_medians(np.array([3.0, 1.0, 2.0]), weights).tolist() == [2.0, 2.0, 3.0]


def test_each_eyes_gazes_are_reached_by_its_mirror() -> None:
    for role in EYES:
        grid = CANDIDATES.gazes[role]
        assert grid.reached.any()
        index = int(np.flatnonzero(grid.reached.ravel())[0])
        assert CALIBRATION.eye(role).mirror.contains(*np.arctan(grid.gaze(index)).tolist())
    assert CANDIDATES.errors.both_per_m < 0.5 * CANDIDATES.errors.one_eye_per_m
    assert Role.LEFT in CANDIDATES.gazes
