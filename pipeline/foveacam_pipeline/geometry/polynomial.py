"""Bivariate polynomials of one total degree on scaled variables, and their robust fit (Eqs. 2-4).

Scaling the variables to about -1..1 keeps the normal matrix well conditioned; leave-one-out errors come
from the hat matrix, without refitting.
"""

from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.geometry.shapes import as_finite_rows, as_rows

HUBER_K = 1.345
"""Residuals beyond this many robust standard deviations are down-weighted (95 % efficiency, Huber 1981)."""
_IRLS_ROUNDS = 30
_IRLS_STOP = 1e-7
_OUTLIER_SIGMAS = 4.0
_SAMPLES_PER_TERM = 3
OUTLIER_WEIGHT = HUBER_K / _OUTLIER_SIGMAS
"""Weight of a residual of four robust standard deviations; residuals of less weight are outliers."""


def exponents(order: int) -> list[tuple[int, int]]:
    """Return the powers (i, j) of x and y of every monomial up to total degree `order`, by degree."""
    if order < 0:
        raise InvalidInput(f"polynomial order {order}: give 0 or more")
    return [(degree - j, j) for degree in range(order + 1) for j in range(degree + 1)]


def monomials(x: ArrayLike, y: ArrayLike, order: int) -> NDArray[np.float64]:
    """Return (n, k) float64: every x^i y^j, i + j <= order, of scaled variables (n,)."""
    of_x, of_y = (_powers(np.atleast_1d(np.asarray(each, dtype=np.float64)), order) for each in (x, y))
    return _products(of_x, of_y, *_exponent_arrays(order))


@cache
def _exponent_arrays(order: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    pairs = np.array(exponents(order), dtype=np.intp)
    return pairs[:, 0], pairs[:, 1]


def _powers(values: NDArray[np.float64], order: int) -> NDArray[np.float64]:
    """Return (..., order + 1) float64: values^0 to values^order of (...) values."""
    powers = np.ones((*values.shape, order + 1))
    powers[..., 1:] = values[..., None]
    return np.multiply.accumulate(powers, axis=-1, out=powers)


def _products(
    of_x: NDArray[np.float64], of_y: NDArray[np.float64], i: NDArray[np.intp], j: NDArray[np.intp]
) -> NDArray[np.float64]:
    """Return (n, k) products of powers, (n, order + 1) each, by their exponents, (k,) each."""
    return np.asarray(of_x[:, i] * of_y[:, j], dtype=np.float64)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BivariatePolynomial:
    """m polynomials of two variables sharing one basis.

    The basis variables are (x - centre) / scale. `coefficients`: (k, m) float64, rows as `exponents`.
    """

    order: int
    centre: tuple[float, float]
    scale: tuple[float, float]
    coefficients: NDArray[np.float64]

    def _powers(self, xy: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the powers, (n, order + 1), of both scaled variables at `xy`: (n, 2)."""
        rows = as_rows(xy, columns=2, name="xy")
        powers = _powers((rows - self.centre) / self.scale, self.order)
        return powers[:, 0], powers[:, 1]

    def basis(self, xy: ArrayLike) -> NDArray[np.float64]:
        """Return the (n, k) monomials at `xy`: (n, 2)."""
        return _products(*self._powers(xy), *_exponent_arrays(self.order))

    def __call__(self, xy: ArrayLike) -> NDArray[np.float64]:
        """Return (n, m) float64 values at `xy`: (n, 2)."""
        values: NDArray[np.float64] = self._value(*self._powers(xy))
        return values

    def jacobian(self, xy: ArrayLike) -> NDArray[np.float64]:
        """Return (n, m, 2) float64 derivatives to x and to y at `xy`: (n, 2)."""
        return self._jacobian(*self._powers(xy))

    def value_and_jacobian(self, xy: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return values and derivatives at `xy`: (n, 2), for little more than the cost of one."""
        powers = self._powers(xy)
        return self._value(*powers), self._jacobian(*powers)

    def _value(self, of_x: NDArray[np.float64], of_y: NDArray[np.float64]) -> NDArray[np.float64]:
        return _products(of_x, of_y, *_exponent_arrays(self.order)) @ self.coefficients

    def _jacobian(self, of_x: NDArray[np.float64], of_y: NDArray[np.float64]) -> NDArray[np.float64]:
        i, j = _exponent_arrays(self.order)
        by_x = i * _products(of_x, of_y, np.maximum(i - 1, 0), j)
        by_y = j * _products(of_x, of_y, i, np.maximum(j - 1, 0))
        return np.stack(
            [by_x @ self.coefficients / self.scale[0], by_y @ self.coefficients / self.scale[1]], axis=2
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PolynomialFit:
    """A fitted polynomial and the quality of the fit.

    `residuals`, `loo_residuals`, `weights`, `leverage`: (n, m); value minus fit, the same with the row left
    out (leave-one-out), the final robust weights (1 = full), and the diagonal of the hat matrix.
    """

    polynomial: BivariatePolynomial
    residuals: NDArray[np.float64]
    loo_residuals: NDArray[np.float64]
    weights: NDArray[np.float64]
    leverage: NDArray[np.float64]

    @property
    def rms(self) -> NDArray[np.float64]:
        """(m,) root mean square residual; outliers left out."""
        return _rms_without_outliers(self.residuals, self.weights)

    @property
    def loo_rms(self) -> NDArray[np.float64]:
        """(m,) root mean square leave-one-out residual; outliers left out."""
        return _rms_without_outliers(self.loo_residuals, self.weights)

    @property
    def scatter(self) -> NDArray[np.float64]:
        """(m,) standard deviation of a value about the fit (by degrees of freedom; outliers left out)."""
        inlier = self.weights > OUTLIER_WEIGHT
        free = np.sum(inlier * (1.0 - self.leverage), axis=0)
        sigma: NDArray[np.float64] = np.sqrt(
            np.sum(inlier * self.residuals**2, axis=0) / np.maximum(free, 1.0)
        )
        return sigma


def _rms_without_outliers(
    residuals: NDArray[np.float64], weights: NDArray[np.float64]
) -> NDArray[np.float64]:
    inlier = weights > OUTLIER_WEIGHT
    rms: NDArray[np.float64] = np.sqrt(np.sum(inlier * residuals**2, axis=0) / np.sum(inlier, axis=0))
    return rms


def huber_weights(residuals: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n,) Huber weights of (n,) residuals about zero, scaled by their median absolute value."""
    size = np.abs(residuals)
    tiny = float(np.finfo(np.float64).tiny)
    sigma = max(1.4826 * float(np.median(size)), tiny)
    return np.minimum(1.0, HUBER_K * sigma / np.maximum(size, tiny))


def least_squares(matrix: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the least-squares solution of `matrix` @ x = `values`, by SVD."""
    return np.asarray(np.linalg.lstsq(matrix, values, rcond=None)[0], dtype=np.float64)


def _solve(
    orthonormal: NDArray[np.float64], values: NDArray[np.float64], loss: str
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return coordinates (k,), weights (n,) and leverage (n,) of one output; `orthonormal`: (n, k) basis."""
    weights = np.ones(len(values))
    coordinates = orthonormal.T @ values
    for _ in range(_IRLS_ROUNDS if loss == "huber" else 0):
        weights = huber_weights(values - orthonormal @ coordinates)
        weighted = orthonormal * weights[:, None]
        update = np.asarray(np.linalg.solve(orthonormal.T @ weighted, weighted.T @ values), dtype=np.float64)
        moved = float(np.max(np.abs(update - coordinates)))
        coordinates = update
        if moved <= _IRLS_STOP * float(np.max(np.abs(coordinates), initial=1e-300)):
            break
    weighted = orthonormal * weights[:, None]
    inverse_gram = np.linalg.inv(orthonormal.T @ weighted)
    leverage = np.sum((weighted @ inverse_gram) * orthonormal, axis=1)
    return coordinates, weights, np.asarray(leverage, dtype=np.float64)


def scaling_of(xy: NDArray[np.float64]) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the centre and scale that map (n, 2) rows to -1..1 in each column."""
    low, high = xy.min(axis=0), xy.max(axis=0)
    centre, half = (low + high) / 2.0, (high - low) / 2.0
    half = np.where(half > 0.0, half, 1.0)
    return (float(centre[0]), float(centre[1])), (float(half[0]), float(half[1]))


def fit_polynomial(
    xy: ArrayLike, values: ArrayLike, order: int, loss: Literal["huber", "square"] = "huber"
) -> PolynomialFit:
    """Fit polynomials of total degree `order` to `values`: (n, m) at `xy`: (n, 2)."""
    rows = as_finite_rows(xy, columns=2, name="xy")
    target = np.asarray(values, dtype=np.float64)
    if target.ndim != 2 or len(target) != len(rows) or not np.isfinite(target).all():
        raise InvalidInput(
            f"values: finite ({len(rows)}, m) are needed for {len(rows)} rows of xy, {target.shape} was given"
        )
    needed = len(exponents(order)) + 1
    if len(rows) < needed:
        raise InvalidInput(
            f"a fit of order {order} needs at least {needed} samples, {len(rows)} were given; "
            "add samples or lower the order"
        )
    centre, scale = scaling_of(rows)
    basis = monomials((rows[:, 0] - centre[0]) / scale[0], (rows[:, 1] - centre[1]) / scale[1], order)
    orthonormal, triangle = np.linalg.qr(basis)  # once; the robust rounds then work on small, sound matrices
    solved = [_solve(orthonormal, column, loss) for column in target.T]
    coordinates, weights, leverage = (np.column_stack(part) for part in zip(*solved, strict=True))
    coefficients = np.asarray(np.linalg.solve(triangle, coordinates), dtype=np.float64)
    residuals = target - basis @ coefficients
    return PolynomialFit(
        polynomial=BivariatePolynomial(order=order, centre=centre, scale=scale, coefficients=coefficients),
        residuals=residuals,
        loo_residuals=residuals / np.maximum(1.0 - leverage, 1e-9),
        weights=weights,
        leverage=leverage,
    )


def fit_best_order(
    xy: ArrayLike,
    values: ArrayLike,
    *,
    orders: tuple[int, ...],
    loss: Literal["huber", "square"] = "huber",
    tolerance: float = 0.02,
) -> PolynomialFit:
    """Fit the lowest order whose leave-one-out error is within `tolerance` of the best one's.

    Errors are clipped at one limit for all orders, so that no order hides its misfits as outliers. An order
    with fewer than three samples per coefficient is not tried, because robust weights would then fit noise.
    """
    rows = as_finite_rows(xy, columns=2, name="xy")
    feasible = [order for order in orders if _SAMPLES_PER_TERM * len(exponents(order)) <= len(rows)]
    if not feasible:
        return fit_polynomial(rows, values, min(orders), loss)  # raises with the number of samples needed
    fits = [fit_polynomial(rows, values, order, loss) for order in sorted(feasible)]
    cap = (
        _OUTLIER_SIGMAS * 1.4826 * np.min([np.median(np.abs(f.loo_residuals), axis=0) for f in fits], axis=0)
    )
    errors = [float(np.sqrt(np.mean(np.minimum(np.abs(f.loo_residuals), cap) ** 2))) for f in fits]
    limit = min(errors) * (1.0 + tolerance)
    return next(fit for fit, error in zip(fits, errors, strict=True) if error <= limit)
