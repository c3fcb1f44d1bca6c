"""The filter of position and velocity."""

import math

import mpmath
import numpy as np
import pytest

from foveacam_pipeline.track.position_filter import ACCELERATION_PSD, PositionFilter, _motion

SIGMA_TAN, SIGMA_PER_M = 1.0e-4, 3.0e-5
STEP_NS = 100_000_000
FADING_S = 0.7


def truth(t_ns: int) -> np.ndarray:
    t_s = t_ns / 1e9
    return np.array([0.5 + 1.2 * t_s, 0.2, 10.0 - 0.8 * t_s])


def measured(t_ns: int, rng: np.random.Generator) -> tuple[np.ndarray, float]:
    x, y, z = truth(t_ns)
    return np.array([x, y]) / z + rng.normal(0, SIGMA_TAN, 2), 1.0 / z + rng.normal(0, SIGMA_PER_M)


def filled(steps: int, seed: int) -> PositionFilter:
    rng = np.random.default_rng(seed)
    found = PositionFilter(truth(0), sigma_m=0.2, t_ns=0, fading_s=FADING_S)
    for step in range(1, steps + 1):
        t_ns = step * STEP_NS
        tangents, inverse_z = measured(t_ns, rng)
        assert found.see(
            t_ns, tangents, sigma=SIGMA_TAN, inverse_z_per_m=inverse_z, inverse_z_sigma_per_m=SIGMA_PER_M
        )
    return found


def test_it_learns_position_and_velocity() -> None:
    estimate = filled(30, seed=1).at(30 * STEP_NS)
    np.testing.assert_allclose(estimate.position_rig_m, truth(30 * STEP_NS), atol=0.02)
    np.testing.assert_allclose(estimate.velocity_rig_m_s, [1.2, 0.0, -0.8], atol=0.25)
    assert estimate.distance_m == pytest.approx(np.linalg.norm(truth(30 * STEP_NS)), abs=0.02)


def test_its_error_is_as_large_as_it_says() -> None:
    t_ns = 20 * STEP_NS
    ratios = []
    for seed in range(60):
        estimate = filled(20, seed=seed).at(t_ns)
        error_m = estimate.distance_m - float(np.linalg.norm(truth(t_ns)))
        ratios.append(error_m / estimate.distance_sigma_m)
    assert (
        0.3 < np.sqrt(np.mean(np.square(ratios))) < 1.3
    )  # it allows for accelerations that this one has not


def test_directions_alone_keep_the_track_and_leave_the_depth_open() -> None:
    found, rng = filled(20, seed=3), np.random.default_rng(3)
    before = found.at(20 * STEP_NS)
    for step in range(21, 26):
        tangents, _ = measured(step * STEP_NS, rng)
        assert found.see(step * STEP_NS, tangents, sigma=SIGMA_TAN)
    after = found.at(25 * STEP_NS)
    np.testing.assert_allclose(after.tangents, truth(25 * STEP_NS)[:2] / truth(25 * STEP_NS)[2], atol=5e-4)
    assert after.distance_sigma_m > 3.0 * before.distance_sigma_m


def test_what_cannot_be_of_this_target_changes_nothing() -> None:
    found = filled(20, seed=4)
    before = found.at(20 * STEP_NS)
    assert not found.see(20 * STEP_NS, before.tangents + 0.2, sigma=SIGMA_TAN)
    np.testing.assert_array_equal(found.at(20 * STEP_NS).position_rig_m, before.position_rig_m)


def test_an_older_measurement_counts_for_its_own_time() -> None:
    found = filled(20, seed=5)
    rng = np.random.default_rng(5)
    for _ in range(20):
        tangents, _ = measured(19 * STEP_NS, rng)
        assert found.see(19 * STEP_NS, tangents, sigma=SIGMA_TAN)
    expected = truth(20 * STEP_NS)[:2] / truth(20 * STEP_NS)[2]
    np.testing.assert_allclose(found.at(20 * STEP_NS).tangents, expected, atol=1e-3)


def test_a_copy_goes_its_own_way() -> None:
    found = filled(20, seed=6)
    other, before = found.copy(), found.at(20 * STEP_NS)
    tangents, _ = measured(25 * STEP_NS, np.random.default_rng(6))
    assert other.see(25 * STEP_NS, tangents, sigma=SIGMA_TAN)
    np.testing.assert_array_equal(found.at(20 * STEP_NS).position_rig_m, before.position_rig_m)


def test_what_is_not_seen_walks_on_for_a_while_and_comes_to_rest_somewhere() -> None:
    """The way is the speed times the time constant, and the spread is that of a thing that may turn."""
    found = PositionFilter(
        np.array([0.0, 0.0, 10.0]), sigma_m=0.01, t_ns=0, fading_s=FADING_S, velocity_rig_m_s=(0.0, 0.0, -2.0)
    )
    soon, late = found.at(70_000_000), found.at(10_000_000_000)
    assert soon.position_rig_m[2] == pytest.approx(10.0 - 0.07 * 2.0, rel=1e-3)
    assert late.position_rig_m[2] == pytest.approx(10.0 - FADING_S * 2.0, rel=1e-6)
    assert abs(late.velocity_rig_m_s[2]) < 1e-4
    still_m_s = math.sqrt(ACCELERATION_PSD * FADING_S / 2.0)
    assert math.sqrt(late.covariance[5, 5]) == pytest.approx(still_m_s, rel=1e-3)


@pytest.mark.parametrize("later_s", [0.05, 0.4, 2.0])
def test_a_time_ahead_is_reached_in_one_step_as_in_many(later_s: float) -> None:
    whole, parts = (
        PositionFilter(np.array([1.0, 0.5, 8.0]), sigma_m=0.1, t_ns=0, fading_s=FADING_S) for _ in range(2)
    )
    covariance, many = parts.at(0).covariance, 50
    step_s = later_s / many
    transition, noise = (np.kron(each, np.eye(3)) for each in _motion(step_s, FADING_S))
    for _ in range(many):
        covariance = transition @ covariance @ transition.T + noise
    np.testing.assert_allclose(whole.at(round(1e9 * later_s)).covariance, covariance, rtol=1e-6, atol=1e-9)


def test_the_depth_of_what_the_wide_view_alone_sees_does_not_run_off() -> None:
    found = PositionFilter(
        np.array([-0.6, 0.3, 9.0]), sigma_m=0.05, t_ns=0, fading_s=FADING_S, velocity_rig_m_s=(0.3, 0.0, -1.2)
    )
    for step in range(1, 80):
        angle = 2.3 * step * 0.033
        tangents = np.array([-0.6 + 0.35 * math.sin(angle), 0.3]) / 9.0
        assert found.see(step * 33_000_000, tangents, sigma=SIGMA_TAN)
    assert found.at(80 * 33_000_000).position_rig_m[2] > 6.0


def test_a_sharp_look_after_a_vague_guess_keeps_the_digits_of_the_error() -> None:
    place, sharp = np.array([0.3, 0.1, 2.0]), 1e-6
    found = PositionFilter(place, sigma_m=1.0, t_ns=0, fading_s=FADING_S)
    before = found.at(0).covariance

    assert found.see(0, place[:2] / place[2], sigma=sharp, inverse_z_per_m=0.5, inverse_z_sigma_per_m=sharp)

    with mpmath.workdps(50):  # prior - gain design prior cancels twelve
        x, y, z = (mpmath.mpf(each) for each in place.tolist())
        slopes = mpmath.matrix([[1 / z, 0, -x / z**2], [0, 1 / z, -y / z**2], [0, 0, -1 / z**2]])
        prior = mpmath.matrix(before[:3, :3].tolist())
        spread = slopes * prior * slopes.T + mpmath.mpf(sharp) ** 2 * mpmath.eye(3)
        posterior = prior - prior * slopes.T * spread**-1 * slopes * prior
        expected = np.array(posterior.tolist(), dtype=np.float64)
    rounding = 32.0 * np.finfo(np.float64).eps
    least = rounding * np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    assert (np.abs(found.at(0).covariance[:3, :3] - expected) <= least).all()
