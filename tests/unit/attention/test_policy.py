from dataclasses import replace

import numpy as np
import pytest
from tests.support.scenes.plane_head import CALIBRATION
from tests.unit.attention.states import unknown_state

from foveacam_hardware.contract import Role
from foveacam_pipeline.attention.field import FieldGrid, Yields
from foveacam_pipeline.attention.looks import Candidates
from foveacam_pipeline.attention.policy import AttentionPolicy, match_chance, weighted_medians
from foveacam_pipeline.verge.aim import EYES, reachable_eyes

GRID = FieldGrid.of(CALIBRATION.wide, context_cell_px=8)
CANDIDATES = Candidates(CALIBRATION, GRID)
NEAR_PER_M, FAR_PER_M = 1.0 / 2.5, 1.0 / 25.0


def mapping(*, least_worth: float = 0.5) -> AttentionPolicy:
    return AttentionPolicy(CANDIDATES, least_worth=least_worth)


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


def test_what_both_eyes_would_show_counts_once() -> None:
    """Else two eyes at one place that is worth a look promise twice what there is to learn."""
    here = np.hypot(*GRID.tangents.T) < 0.03
    sigma = np.where(here[:, None], np.inf, 0.001) * np.ones((1, 9))
    state = replace(unknown_state(len(GRID), inverse_z=NEAR_PER_M), relative_sigma=sigma)
    look = mapping().choose(state)
    assert look is not None
    assert 0.5 * here.sum() < look.promised <= here.sum()


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


def test_cells_that_looks_left_as_they_were_are_tried_less() -> None:
    state = unknown_state(3)
    tried = replace(state, contrast=np.array([0.0, 3.0, 3.0]), tries=np.array([0, 0, 3]))
    blank, fresh, left = match_chance(tried)
    assert blank < 0.05
    assert fresh == pytest.approx(0.9)
    assert left < 0.05


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
