"""Bivariate polynomials: exactness, derivatives, robustness, honest leave-one-out errors."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.geometry.polynomial import (
    exponents,
    fit_best_order,
    fit_polynomial,
    huber_weights,
    monomials,
)


def grid(side: int, *, half: float = 170.0) -> NDArray[np.float64]:
    line = np.linspace(-half, half, side)
    return np.array([(x, y) for y in line for x in line])


def cubic(xy: NDArray[np.float64]) -> NDArray[np.float64]:
    x, y = xy[:, 0] / 170.0, xy[:, 1] / 170.0
    return np.column_stack([0.16 * x - 0.02 * x**3 + 0.006 * y * y, 0.14 * y - 0.01 * x * x * y + 0.002])


@pytest.mark.parametrize(("order", "count"), [(0, 1), (1, 3), (2, 6), (3, 10), (5, 21)])
def test_total_degree_basis_has_the_right_number_of_terms(order: int, count: int) -> None:
    assert len(exponents(order)) == count
    assert monomials([1.0, 2.0], [3.0, 4.0], order).shape == (2, count)


def test_cubic_data_is_reproduced_to_rounding_at_points_not_fitted() -> None:
    fit = fit_polynomial(grid(9), cubic(grid(9)), 3)
    unseen = np.random.default_rng(1).uniform(-170, 170, (50, 2))
    np.testing.assert_allclose(fit.polynomial(unseen), cubic(unseen), atol=1e-14)


@settings(max_examples=30, deadline=None)
@given(x=st.floats(-160, 160), y=st.floats(-160, 160))
def test_jacobian_is_the_slope_of_the_values(x: float, y: float) -> None:
    polynomial = fit_polynomial(grid(9), cubic(grid(9)), 3).polynomial
    step = 1e-3
    for axis in (0, 1):
        side = np.eye(2)[axis] * step
        slope = (polynomial([np.array([x, y]) + side]) - polynomial([np.array([x, y]) - side])) / (2 * step)
        np.testing.assert_allclose(polynomial.jacobian([[x, y]])[0, :, axis], slope[0], rtol=1e-6, atol=1e-11)
    value, jacobian = polynomial.value_and_jacobian([[x, y]])
    np.testing.assert_array_equal(value, polynomial([[x, y]]))
    np.testing.assert_array_equal(jacobian, polynomial.jacobian([[x, y]]))


def test_leave_one_out_by_hat_matrix_equals_refitting_without_the_sample() -> None:
    rng = np.random.default_rng(2)
    xy = grid(6)
    values = cubic(xy) + 1e-3 * rng.standard_normal((len(xy), 2))
    fit = fit_polynomial(xy, values, 3, "square")
    for k in (0, 7, 35):
        kept = np.arange(len(xy)) != k
        without = fit_polynomial(xy[kept], values[kept], 3, "square").polynomial
        np.testing.assert_allclose(fit.loo_residuals[k], (values[k] - without(xy[[k]])[0]), atol=1e-12)


def test_outliers_do_not_bend_a_robust_fit() -> None:
    rng = np.random.default_rng(3)
    xy = grid(9)
    values = cubic(xy) + 1e-4 * rng.standard_normal((len(xy), 2))
    values[[5, 40, 61]] += 0.02  # two hundred times the noise
    robust = fit_polynomial(xy, values, 3).polynomial
    plain = fit_polynomial(xy, values, 3, "square").polynomial
    worst_robust = np.abs(robust(xy) - cubic(xy)).max()
    assert worst_robust < 3e-4  # three times the noise of one sample
    assert np.abs(plain(xy) - cubic(xy)).max() > 5 * worst_robust


def test_huber_weights_are_one_within_the_limit_and_fall_beyond() -> None:
    weights = huber_weights(np.array([1.0, -1.0, 1.0, -1.0, 10.0]))
    np.testing.assert_allclose(weights[:4], 1.0)
    assert weights[4] == pytest.approx(1.345 * 1.4826 / 10.0)


def test_order_is_chosen_by_leave_one_out() -> None:
    rng = np.random.default_rng(4)
    values = cubic(grid(11)) + 1e-4 * rng.standard_normal((121, 2))
    assert fit_best_order(grid(11), values, orders=(1, 2, 3, 4, 5)).polynomial.order == 3


def test_scatter_estimates_the_noise_whatever_the_order() -> None:
    rng = np.random.default_rng(5)
    values = cubic(grid(13)) + 1e-3 * rng.standard_normal((169, 2))
    for order in (3, 6):
        np.testing.assert_allclose(
            fit_polynomial(grid(13), values, order, "square").scatter, 1e-3, rtol=0.2
        )  # 169 samples know a standard deviation to 6 %


def test_too_few_samples_name_the_number_needed() -> None:
    with pytest.raises(InvalidInput, match="order 3 needs at least 11 samples, 9 were given"):
        fit_polynomial(grid(3), cubic(grid(3)), 3)


def test_a_sample_that_is_not_finite_is_named() -> None:
    xy = grid(5)
    xy[7, 1] = np.nan
    with pytest.raises(InvalidInput, match="xy: row 7"):
        fit_polynomial(xy, cubic(grid(5)), 2)


def test_a_wrong_shape_is_named() -> None:
    with pytest.raises(InvalidInput, match=r"xy: shape \(n, 2\) is needed, \(4, 3\)"):
        fit_polynomial(np.zeros((4, 3)), np.zeros((4, 1)), 1)
