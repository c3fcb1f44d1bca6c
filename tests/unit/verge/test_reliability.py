"""The figures of alternatives: which count as said, and whether their probabilities are true."""

import math

import pytest

from foveacam_bench.verge.reliability import reliability, right, said
from foveacam_pipeline.verge.values import Alternative, Basis


def at(distance_m: float, probability: float = 0.5, *, sigma_m: float = 0.01) -> Alternative:
    return Alternative(
        basis=Basis.SURROUNDINGS,
        distance_m=distance_m,
        distance_sigma_m=sigma_m,
        point_rig_m=(0.0, 0.0, distance_m),
        probability=probability,
    )


@pytest.mark.parametrize(
    ("alternative", "expected"),
    [
        (at(4.1), True),
        (at(4.2), False),
        (at(4.2, sigma_m=0.1), True),
        (at(4.5, sigma_m=3.0), False),
    ],
)
def test_right_is_near_or_within_its_error_but_no_vague_guess(
    alternative: Alternative, expected: bool
) -> None:
    assert right(alternative, 4.0) is expected
    assert right(alternative, math.inf) is False


def test_an_unlikely_alternative_is_not_said() -> None:
    assert said([at(2.0, 0.85), at(4.0, 0.15)], 4.0)
    assert not said([at(2.0, 0.9), at(4.0, 0.1)], 4.0)
    assert not said([], 4.0)


def test_probabilities_are_compared_with_the_share_that_is_right() -> None:
    true = [(0.8, k < 8) for k in range(10)] + [(0.2, k < 2) for k in range(10)]
    boastful = [(0.9, k < 5) for k in range(10)]
    assert reliability(true)["stated_probability_error"] == pytest.approx(0.0)
    assert reliability(boastful)["stated_probability_error"] == pytest.approx(0.4)
    assert reliability(boastful)["reliability"] == [{"count": 10, "stated": 0.9, "right": 0.5}]
    assert reliability([])["stated_probability_error"] is None


def test_probabilities_that_are_too_high_do_not_make_up_for_those_that_are_too_low() -> None:
    boastful, modest = [(0.9, k < 5) for k in range(10)], [(0.2, k < 6) for k in range(10)]
    assert reliability(boastful + modest)["stated_probability_error"] == pytest.approx(0.4)
