"""Alignment, RMS and its interval, and whether a trajectory shows the infinity sign."""

import math

import numpy as np
import pytest

from foveacam_pipeline.study.localisation.accuracy import (
    aligned,
    centroid_offsets_m,
    depth_correlation,
    rms_interval,
    shows_infinity,
    trajectory_errors,
)
from foveacam_pipeline.study.localisation.rail import (
    CHEST_FRONT_M,
    FOOT_Y_M,
    HALF_WIDTH_M,
    LOBE_DEPTH_M,
    infinity_m,
    slots,
    targets_m,
)

TRUTH_M = targets_m(slots(16), 10.0)


def rng() -> np.random.Generator:
    return np.random.default_rng(4)


def test_the_rail_is_an_infinity_sign_about_its_centre() -> None:
    x_m, z_m = infinity_m(np.linspace(0.0, 2.0 * np.pi, 100_001))
    assert np.ptp(x_m) == pytest.approx(2.0 * HALF_WIDTH_M, rel=1e-6)
    assert np.ptp(z_m[x_m > 0.0]) == pytest.approx(LOBE_DEPTH_M, rel=1e-6)
    # a lemniscate of Bernoulli: the product of the distances from both foci is constant
    focus_m = HALF_WIDTH_M / math.sqrt(2.0)
    product = np.hypot(x_m - focus_m, z_m) * np.hypot(x_m + focus_m, z_m)
    assert product == pytest.approx(focus_m**2, rel=1e-6)


@pytest.mark.parametrize("count", [2, 8, 16])
def test_the_slots_are_on_the_rail_and_apart(count: int) -> None:
    places = slots(count)
    assert len({(round(place.x_m, 6), round(place.z_m, 6)) for place in places}) == count
    assert min(math.hypot(place.x_m, place.z_m) for place in places) > 0.005, "none is the crossing"
    assert sum(place.x_m for place in places) == pytest.approx(0.0, abs=1e-12)
    x_m, y_m, z_m = places[0].target_m(5.0)
    assert places[0].foot_m(5.0) == pytest.approx((x_m, y_m + FOOT_Y_M, z_m + CHEST_FRONT_M))


def test_alignment_removes_what_a_run_has_in_common_and_reports_it() -> None:
    offsets_m = np.array([[0.01, -0.02, 0.3], [0.0, 0.0, -0.1]])
    points_m = TRUTH_M + offsets_m[:, None, :]
    assert aligned(points_m, TRUTH_M) == pytest.approx(np.stack([TRUTH_M, TRUTH_M]))
    assert centroid_offsets_m(points_m, TRUTH_M) == pytest.approx(offsets_m)
    errors = trajectory_errors(points_m, TRUTH_M, rng=rng())
    assert errors is not None
    assert errors.rms.value == pytest.approx(0.0, abs=1e-9)
    assert errors.drift_m == pytest.approx((0.005, -0.01, 0.1))
    assert errors.depth.value == pytest.approx(math.sqrt((0.3**2 + 0.1**2) / 2.0))


def test_a_target_that_was_not_found_counts_in_no_mean() -> None:
    points_m = TRUTH_M[None] + np.array([0.0, 0.0, 0.05])
    points_m[0, 3] = np.nan
    errors = trajectory_errors(points_m, TRUTH_M, rng=rng())
    assert errors is not None
    assert errors.found == pytest.approx(15 / 16)
    assert errors.drift_m[2] == pytest.approx(0.05)
    assert errors.rms.value == pytest.approx(0.0, abs=1e-9)
    assert trajectory_errors(np.full_like(points_m, np.nan), TRUTH_M, rng=rng()) is None


def test_the_rms_is_that_of_the_three_axes() -> None:
    sign = (-1.0) ** np.arange(16)
    points_m = TRUTH_M[None] + sign[:, None] * np.array([0.003, 0.0, 0.004])
    errors = trajectory_errors(points_m, TRUTH_M, rng=rng())
    assert errors is not None
    assert errors.rms.value == pytest.approx(0.005)
    assert errors.depth_rms_m == pytest.approx(0.004)
    assert math.isnan(errors.noise_m), "one run does not tell its noise"


def test_the_noise_is_what_differs_between_runs() -> None:
    noise_m = 1e-3 * np.random.default_rng(1).standard_normal((200, 16, 3))
    shared_m = 0.01 * np.random.default_rng(2).standard_normal((16, 3))
    errors = trajectory_errors(TRUTH_M + shared_m + noise_m, TRUTH_M, rng=rng())
    assert errors is not None
    assert errors.noise_m == pytest.approx(1e-3, rel=0.05)
    assert errors.rms.value > 5e-3


def test_the_noise_of_two_runs_is_not_too_small_for_being_of_two() -> None:
    truth_m = targets_m(slots(400), 10.0)
    noise_m = 1e-3 * np.random.default_rng(3).standard_normal((2, 400, 3))
    errors = trajectory_errors(truth_m + noise_m, truth_m, rng=rng())
    assert errors is not None
    assert errors.noise_m == pytest.approx(1e-3, rel=0.12)  # three of its standard errors


def test_intervals_contain_the_true_rms_as_often_as_they_say() -> None:
    inside = 0
    for seed in range(200):
        drawn = np.random.default_rng(seed).standard_normal((4, 40)) ** 2
        interval = rms_interval(drawn, rng=np.random.default_rng(seed), repeats=300)
        assert interval.low < interval.value < interval.high
        inside += interval.low < 1.0 < interval.high
    assert 0.88 < inside / 200 <= 0.995


def test_errors_that_runs_share_widen_the_interval() -> None:
    drawn = np.random.default_rng(5).standard_normal((6, 12)) ** 2
    free, shared = (
        rms_interval(squares, rng=rng()) for squares in (drawn, np.broadcast_to(drawn[:1], drawn.shape))
    )
    assert (shared.high - shared.low) / shared.value > 1.5 * (free.high - free.low) / free.value


def test_a_trajectory_shows_the_sign_or_does_not() -> None:
    noise = np.random.default_rng(6).standard_normal(16)
    off = np.array([0.02, 0.0, 0.7])
    near, far = (TRUTH_M + off + np.outer(noise, [0.0, 0.0, size_m]) for size_m in (0.005, 0.05))
    assert shows_infinity(near, TRUTH_M)
    assert depth_correlation(near, TRUTH_M) > 0.97
    assert not shows_infinity(far, TRUTH_M)
    flat = TRUTH_M.copy()
    flat[:, 2] = 10.0
    assert not shows_infinity(flat, TRUTH_M)
    assert depth_correlation(flat, TRUTH_M) == 0.0
    assert not shows_infinity(TRUTH_M * [1.0, 1.0, -1.0], TRUTH_M), "mirrored in depth"


def test_a_sign_with_half_of_its_slots_is_none() -> None:
    half = TRUTH_M.copy()
    half[::2] = np.nan
    assert depth_correlation(half, TRUTH_M) == pytest.approx(1.0)
    assert not shows_infinity(half, TRUTH_M)
