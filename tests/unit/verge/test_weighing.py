"""How measurements of one target are weighed against each other."""

from dataclasses import replace

import numpy as np
import pytest

from foveacam_hardware.contract import Role
from foveacam_pipeline.verge.distance import place_on_ray
from foveacam_pipeline.verge.single_eye.eye_match import EyeMatch
from foveacam_pipeline.verge.single_eye.weighing import (
    agree,
    confirmed,
    only_sure,
    outdone,
    plausible,
    weighted,
)
from foveacam_pipeline.verge.surroundings.infer import InferredDepth, spread_per_m
from foveacam_pipeline.verge.surroundings.stated_depth import DOUBT_SHARE, GAP_CHANCE, stated_depth


def _match(
    inverse_z_per_m: float, *, role: Role = Role.LEFT, sigma_per_m: float = 1.0e-3, score: float = 0.95
) -> EyeMatch:
    return EyeMatch(
        role=role, inverse_z_per_m=inverse_z_per_m, sigma_per_m=sigma_per_m, score=score, row_px=0.0
    )


def _inferred(inverse_z_per_m: float, *, probability: float, owned: bool = True) -> InferredDepth:
    return InferredDepth(
        inverse_z_per_m=inverse_z_per_m,
        sigma_per_m=1.0e-3,
        probability=probability,
        samples=4,
        owned=owned,
        held=True,
    )


def test_a_match_is_plausible_where_a_likely_surface_lies_as_deep_or_nothing_is_known() -> None:
    near = (_inferred(0.5, probability=0.7), _inferred(0.3, probability=0.1))

    assert plausible(_match(0.501), near)
    assert plausible(_match(0.2), ())
    assert not plausible(_match(0.4), near)
    assert not plausible(_match(0.3), near)  # as deep as an unlikely one


def test_only_a_surface_at_the_target_confirms_a_match() -> None:
    around = (_inferred(0.5, probability=0.9, owned=False),)

    assert confirmed(0.5, 1e-3, (_inferred(0.5, probability=0.9),))
    assert not confirmed(0.51, 1e-3, (_inferred(0.5, probability=0.9),))
    assert not confirmed(0.5, 1e-3, around)
    assert confirmed(0.5, 1e-3, (replace(around[0], samples=8),))  # nothing else is there
    assert not confirmed(0.5, 1e-3, ())  # nothing is known there


def test_fewer_points_confirm_a_match_where_the_other_eye_cannot_turn() -> None:
    around = _inferred(0.5, probability=0.9, owned=False)

    assert confirmed(0.5, 1e-3, (around,), alone=True)
    assert not confirmed(0.5, 1e-3, (replace(around, samples=2),), alone=True)
    assert not confirmed(0.5, 1e-3, (replace(around, probability=0.85),), alone=True)
    assert not confirmed(0.52, 1e-3, (around,), alone=True)


def test_two_eyes_agree_within_their_errors_and_the_better_one_counts_more() -> None:
    left, right = _match(0.500, sigma_per_m=1.0e-3), _match(0.504, role=Role.RIGHT, sigma_per_m=2.0e-3)

    mean, sigma = weighted([left, right])

    assert agree(left, right)
    assert not agree(left, _match(0.52, role=Role.RIGHT))
    assert mean == pytest.approx(0.5008)  # weights 4 and 1
    assert sigma == pytest.approx(1.0e-3 / np.sqrt(1.25))


def test_the_spread_of_alternatives_reaches_from_the_best_to_the_others() -> None:
    spread = spread_per_m((_inferred(0.5, probability=0.5), _inferred(0.3, probability=0.5)))

    assert spread == pytest.approx(0.2 * np.sqrt(0.5), rel=1e-3)


def test_an_inference_without_a_point_of_its_own_states_the_chance_of_a_gap() -> None:
    owned = _inferred(0.5, probability=0.95)
    surrounded = replace(owned, owned=False)

    sure, doubtful = (stated_depth((one,), farthest_per_m=0.2, blank=True) for one in (owned, surrounded))
    nothing_behind = stated_depth((surrounded,), farthest_per_m=0.5, blank=True)

    assert sure is not None
    assert sure[1] == pytest.approx(owned.sigma_per_m)
    assert nothing_behind == sure
    assert doubtful is not None
    behind = np.linspace(0.2, 0.5, 1001)  # 1/Z of what may be seen through it
    rms = np.sqrt((1.0 - GAP_CHANCE) * surrounded.sigma_per_m**2 + GAP_CHANCE * np.mean((behind - 0.5) ** 2))
    assert doubtful[1] == pytest.approx(rms, rel=0.01)


@pytest.mark.parametrize("blank", [False, True])
def test_what_surrounds_a_target_among_textures_may_be_something_else(*, blank: bool) -> None:
    owned = _inferred(0.5, probability=0.95)
    surrounded = replace(owned, owned=False)

    own, around = (stated_depth((one,), farthest_per_m=0.5, blank=blank) for one in (owned, surrounded))

    assert own is not None
    assert own[1] == pytest.approx(owned.sigma_per_m)
    assert around is not None
    assert around[1] == pytest.approx(owned.sigma_per_m if blank else DOUBT_SHARE * 0.5)


def test_a_large_error_of_depth_is_stated_as_that_to_the_far_side() -> None:
    place = place_on_ray(np.zeros(2), 0.5, 0.1)

    assert place.distance_m == pytest.approx(2.0)
    assert place.distance_sigma_m == pytest.approx(1.0 / 0.4 - 2.0)


def test_one_place_is_sure_where_nothing_at_another_depth_fits_nearly_as_well() -> None:
    best = _match(0.5, score=0.97)

    assert only_sure([best, _match(0.5005, score=0.96), _match(0.3, score=0.85)]) is best
    assert only_sure([best, _match(0.3, score=0.93)]) is None
    assert only_sure([_match(0.5, score=0.6)]) is None
    assert only_sure([]) is None


def test_an_eye_that_shows_the_target_far_better_elsewhere_outdoes_the_other() -> None:
    hidden = _match(0.65, role=Role.RIGHT, score=0.96)
    repeated = [_match(0.5, score=0.998), _match(0.13, score=0.998)]

    assert only_sure(repeated) is None
    assert outdone(hidden, repeated)
    assert not outdone(hidden, [*repeated, _match(0.651, score=0.998)])  # there too
    assert not outdone(hidden, [_match(0.5, score=0.97)])  # hardly better
    assert not outdone(hidden, [])
