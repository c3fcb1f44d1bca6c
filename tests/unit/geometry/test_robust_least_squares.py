"""The robust least squares of the calibration: weights by groups, a robust loss, and the covariance."""

import mpmath
import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_pipeline.calibrate.robust_least_squares import (
    ResidualModel,
    fit_least_squares,
    fit_reweighted,
    terms_covariance,
)

SIGMA = 0.01
TRUE = np.array([1.5, -0.7])
X = np.linspace(-1.0, 1.0, 200)
ROWS = np.column_stack([np.ones_like(X), X]) / SIGMA


def line_model(*, outliers: int) -> ResidualModel:
    values = TRUE[0] + TRUE[1] * X + np.random.default_rng(4).normal(0.0, SIGMA, len(X))
    values[:outliers] += 100.0 * SIGMA
    return ResidualModel(residuals=lambda terms: ROWS @ terms - values / SIGMA, jacobian=lambda _: ROWS)


def test_the_covariance_is_that_of_the_normal_equations() -> None:
    fit = fit_least_squares(line_model(outliers=0), np.zeros(2))

    assert fit.covariance() == pytest.approx(np.linalg.inv(ROWS.T @ ROWS), abs=1e-12)
    assert np.abs(fit.terms - TRUE).max() < 4.0 * np.sqrt(np.diag(fit.covariance())).max()


@pytest.mark.parametrize("apart", [1e-3, 1e-6])
def test_a_covariance_keeps_the_digits_that_the_condition_of_the_jacobian_leaves(apart: float) -> None:
    rng = np.random.default_rng(6)
    both = rng.normal(size=40)
    rows = np.column_stack([both, both + apart * rng.normal(size=40), 1e6 * rng.normal(size=40)])

    found = terms_covariance(rows)

    with mpmath.workdps(50):
        exact = mpmath.matrix(rows.tolist())
        expected = np.array(((exact.T * exact) ** -1).tolist(), dtype=np.float64)
    lost = np.linalg.cond(rows / np.linalg.norm(rows, axis=0)) * np.finfo(np.float64).eps
    sigmas = np.sqrt(np.diag(expected))
    assert np.abs((found - expected) / np.outer(sigmas, sigmas)).max() < 16.0 * lost
    together = np.array([1.0, 1.0, 0.0])  # known better than each alone, by the factor that both are alike
    assert together @ found @ together == pytest.approx(
        together @ expected @ together, rel=16.0 * lost / apart
    )


def test_a_term_that_nothing_speaks_of_is_unknown() -> None:
    found = terms_covariance(np.column_stack([ROWS, np.zeros(len(X))]))

    assert found[2, 2] > 1e18
    assert found[:2, :2] == pytest.approx(terms_covariance(ROWS))


def test_terms_of_which_only_the_sum_is_told_are_unknown() -> None:
    found = terms_covariance(np.column_stack([ROWS, ROWS[:, 1]]))

    assert min(found[1, 1], found[2, 2]) > 1e18 * SIGMA**2
    total = np.array([0.0, 1.0, 1.0])
    assert found[0, 0] == pytest.approx(terms_covariance(ROWS)[0, 0])
    assert np.sqrt(total @ found @ total) < 1e-6 * np.sqrt(found[1, 1])
    assert (np.diag(terms_covariance(ROWS[:1])) > 1e18 * SIGMA**2).all()  # one row tells no term alone


def test_a_robust_loss_resists_outliers() -> None:
    model = line_model(outliers=10)

    square, robust = (fit_least_squares(model, np.zeros(2), loss=loss) for loss in ("linear", "soft_l1"))

    # A share of 5 % beyond every size shifts the median by 0.07 sigma, and the mean by 5 sigma.
    assert np.abs(square.terms - TRUE).max() > 4.0 * SIGMA
    assert np.abs(robust.terms - TRUE).max() < 0.5 * SIGMA


def test_weights_may_be_given_to_groups_of_residuals() -> None:
    def pair_weights(residuals: NDArray[np.float64]) -> NDArray[np.float64]:
        worst = np.abs(residuals).reshape(-1, 2).max(axis=1)
        return np.repeat(np.where(worst < 10.0, 1.0, 0.0), 2)

    fit = fit_reweighted(line_model(outliers=9), TRUE, weights=pair_weights, rounds=5, stop=1e-9)

    assert (fit.residuals[:10] == 0.0).all()  # the tenth has an outlier beside it
    assert np.abs(fit.terms - TRUE).max() < 0.5 * SIGMA
