"""The election of a mirror's model: the law wins, not the noise, and nodes do not vouch for themselves."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.calibrate.fit.mirror_models import (
    MirrorFit,
    MirrorModelFamily,
    fit_mirror_models,
    fit_stiffening,
    spring_deflection,
)

NOISE_RAD = math.radians(2e-4)
UNSEEN = np.random.default_rng(4).uniform(-165.0, 165.0, (300, 2))


def nodes(side: int = 9) -> NDArray[np.float64]:
    line = -170.0 * np.cos(np.linspace(0.0, math.pi, side))
    return np.array([(x, y) for y in line for x in line])


def cubic(volts: NDArray[np.float64]) -> NDArray[np.float64]:
    x, y = 0.001 * volts[:, 0], 0.0009 * volts[:, 1]
    return np.column_stack([x - 2.0 * x**3 + 0.3 * y**2, y - 1.5 * y**3 - 0.2 * x * y + 1e-3])


def stiff(volts: NDArray[np.float64]) -> NDArray[np.float64]:
    u = spring_deflection(volts / 170.0, (0.21, 0.13))
    return np.column_stack([0.16 * u[:, 0] + 0.01 * u[:, 1] ** 2, 0.15 * u[:, 1] - 0.008 * u[:, 0] * u[:, 1]])


def noisy(values: NDArray[np.float64], *, seed: int = 1) -> NDArray[np.float64]:
    return np.asarray(values + NOISE_RAD * np.random.default_rng(seed).standard_normal(values.shape))


@pytest.fixture(scope="module")
def of_springs() -> MirrorFit:
    return fit_mirror_models(nodes(), noisy(stiff(nodes())))


def test_deflections_solve_the_balance_of_the_springs() -> None:
    share = np.random.default_rng(2).uniform(-1.2, 1.2, (50, 2))
    u = spring_deflection(share, (0.4, 0.0))
    np.testing.assert_allclose(u[:, 0] + 0.4 * u[:, 0] ** 3, share[:, 0], atol=1e-13)
    np.testing.assert_array_equal(u[:, 1], share[:, 1])


def test_stiffening_is_found_again() -> None:
    found = fit_stiffening(nodes() / 170.0, noisy(stiff(nodes())), order=2)
    assert found == pytest.approx((0.21, 0.13), abs=1e-4)  # 2e-4 deg over 9 deg, 81 poses: 1e-5


def test_a_cubic_law_elects_the_cubic() -> None:
    fit = fit_mirror_models(nodes(), noisy(cubic(nodes())))
    assert (fit.chosen.family, fit.chosen.order) == (MirrorModelFamily.POLYNOMIAL, 3)
    assert fit.chosen.paper


def test_springs_are_elected_where_a_mirror_hangs_in_them(of_springs: MirrorFit) -> None:
    assert (of_springs.chosen.family, of_springs.chosen.order) == (MirrorModelFamily.SPRINGS, 2)
    errors = of_springs.model.angles_of(UNSEEN) - stiff(UNSEEN)
    assert np.sqrt(np.mean(errors**2)) < 0.5 * NOISE_RAD  # 7 coefficients of 81 poses: 0.3 of the noise


def test_springs_are_written_down_as_a_polynomial_that_inverts_to_a_step_of_the_dac(
    of_springs: MirrorFit,
) -> None:
    mirror = of_springs.model
    inside = UNSEEN[mirror.inside(mirror.angles_of(UNSEEN))]
    assert len(inside) > 250
    assert np.abs(mirror.volts_for(mirror.angles_of(inside)) - inside).max() < 1e-6


def test_the_table_holds_the_cubic_beside_the_elected_model(of_springs: MirrorFit) -> None:
    papers = [score for score in of_springs.scores if score.paper]
    assert [score.order for score in papers] == [3]
    assert sum(score.chosen for score in of_springs.scores) == 1
    assert of_springs.chosen.judged_rad < 0.5 * papers[0].judged_rad
    assert np.hypot(*of_springs.chosen.loo_rad) == pytest.approx(math.sqrt(2.0) * NOISE_RAD, rel=0.25)


def test_a_node_swept_twice_does_not_vouch_for_itself() -> None:
    volts = np.tile(nodes(), (2, 1))
    angles = np.tile(noisy(cubic(nodes())), (2, 1))  # the same error at both distances, as of the lens
    alone = fit_mirror_models(volts, angles, spring_orders=())
    together = fit_mirror_models(volts, angles, group=np.tile(np.arange(81), 2), spring_orders=())
    for one, both in zip(alone.scores, together.scores, strict=True):
        assert np.hypot(*both.loo_rad) >= np.hypot(*one.loo_rad)
    seen, unseen = alone.scores[-1].loo_rad, together.scores[-1].loo_rad
    assert np.hypot(*unseen) > 1.3 * np.hypot(*seen)


def test_a_group_left_out_is_a_fit_without_it() -> None:
    volts, angles = np.tile(nodes(6), (2, 1)), noisy(cubic(np.tile(nodes(6), (2, 1))))
    group = np.tile(np.arange(36), 2)
    whole = fit_mirror_models(volts, angles, group=group, orders=(3,), spring_orders=())
    kept = group != 14
    without = fit_mirror_models(volts[kept], angles[kept], orders=(3,), spring_orders=())
    missed = angles[~kept] - without.model.angles_of(volts[~kept])
    np.testing.assert_allclose(whole.loo_residuals_rad[~kept], missed, atol=0.2 * NOISE_RAD)  # robust weights


def test_three_poses_a_coefficient_are_needed() -> None:
    few = nodes(3)[:8]
    with pytest.raises(InvalidInput, match="8 poses are too few, order 1 needs 9"):
        fit_mirror_models(few, cubic(few))


def test_an_axis_that_was_never_driven_is_refused() -> None:
    flat = nodes() * np.array([1.0, 0.0])
    with pytest.raises(InvalidInput, match=r"reach only \(170, 0\) V"):
        fit_mirror_models(flat, cubic(flat))
