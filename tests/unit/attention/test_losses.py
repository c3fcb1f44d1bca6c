from dataclasses import replace

import numpy as np
import pytest
from tests.unit.attention.states import unknown_state

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.attention.losses import (
    MISSED,
    DepthRange,
    map_loss,
    part_losses,
    worth_of,
)

RANGE = DepthRange(nearest_m=1.0, farthest_m=20.0)


@pytest.mark.parametrize(
    "given", [{"nearest_m": 0.0}, {"nearest_m": 5.0, "farthest_m": 4.0}, {"goal": 1.0}, {"goal": 0.0}]
)
def test_a_range_that_holds_no_distance_is_refused(given: dict[str, float]) -> None:
    with pytest.raises(InvalidInput, match="nearest < farthest"):
        DepthRange(**given)


def test_the_loss_of_a_part_has_a_step_at_the_goal_and_grows_to_one() -> None:
    losses = part_losses(np.array([0.001, 0.01, 0.0101, 0.1, 1.0, np.inf]), goal=0.01)
    assert losses[:2].tolist() == [0.0, 0.0]
    assert losses[2] == pytest.approx(MISSED, abs=0.001)
    assert losses[3] == pytest.approx((MISSED + 1.0) / 2.0)
    assert losses[4:].tolist() == [1.0, 1.0]


def test_what_is_known_to_lie_outside_the_range_has_no_loss_and_what_is_guessed_has() -> None:
    sigma = np.full((4, 9), 0.1)
    near_and_far = np.array([2.0, 0.01, 0.2, 0.2])
    known = replace(unknown_state(4), inverse_z_per_m=near_and_far, relative_sigma=sigma)
    assert map_loss(known, RANGE)[:2].tolist() == [0.0, 0.0]
    assert (map_loss(known, RANGE)[2:] > 0.5).all()
    guessed = replace(known, guessed=np.ones(4, np.bool_))
    assert (map_loss(guessed, RANGE) > 0.5).all()


def test_a_look_is_worth_the_parts_that_it_improves() -> None:
    sigma = np.full((4, 9), np.inf)
    sigma[1, :3] = 0.001
    sigma[2] = 0.001
    worth = worth_of(replace(unknown_state(4), relative_sigma=sigma), RANGE, relative_sigma=np.full(4, 0.002))
    assert worth == pytest.approx([1.0, 6 / 9, 0.0, 1.0])
