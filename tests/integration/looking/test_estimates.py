"""What is told of a distance before its answer: its stated error is neither too small nor too large."""

import math
from statistics import median

import pytest

from foveacam_bench.verge.field_clicks import JudgedClick, answers
from foveacam_pipeline.verge.values import Basis

CLICKS = 24
pytestmark = pytest.mark.timeout(300)


@pytest.fixture(scope="module")
def clicks() -> list[JudgedClick]:
    return [click for click in answers("bench", CLICKS, binning=2) if math.isfinite(click.range_m)]


def sigmas(clicks: list[JudgedClick], *bases: Basis) -> list[float]:
    """Return the absolute errors of estimates with these bases over the errors that were stated."""
    return [
        abs(value)
        for click in clicks
        for estimate, value in zip(click.estimates, click.estimate_sigmas, strict=True)
        if estimate.basis in bases
    ]


def test_estimates_are_within_their_errors(clicks: list[JudgedClick]) -> None:
    found = sigmas(clicks, *Basis)
    assert len(found) >= CLICKS
    assert sum(value <= 3.0 for value in found) >= 0.9 * len(found)


def test_estimates_of_both_foveae_do_not_state_more_than_they_err(clicks: list[JudgedClick]) -> None:
    found = sigmas(clicks, Basis.BOTH_FOVEAE)
    assert len(found) >= 8
    assert 0.2 <= median(found) <= 1.5


def test_estimates_of_surroundings_are_no_wild_guesses(clicks: list[JudgedClick]) -> None:
    stated = [
        estimate.point.distance_sigma_m / estimate.point.distance_m
        for click in clicks
        for estimate in click.estimates
        if estimate.basis is Basis.SURROUNDINGS
    ]
    assert len(stated) >= 8
    assert min(stated) <= 0.05  # once the target is enclosed
    assert max(stated) <= 1.6
