"""Robust least squares over `scipy.optimize.least_squares`, with the covariance from the Jacobian.

A fit in `calibrate` keeps its own loop only where a measurement favours it; its docstring states which.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy import optimize


@dataclass(frozen=True, slots=True, kw_only=True)
class ResidualModel:
    """Residuals (n,) at terms (k,), and their Jacobian (n, k); without one it is found by differences.

    `term_scales`: (k,) typical sizes of the terms; None derives them from the Jacobian.
    """

    residuals: Callable[[NDArray[np.float64]], NDArray[np.float64]]
    jacobian: Callable[[NDArray[np.float64]], NDArray[np.float64]] | None = None
    term_scales: NDArray[np.float64] | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LeastSquaresFit:
    """The fitted `terms` (k,), with residuals (n,) and Jacobian (n, k) there, both weighted.

    `cost`: half the sum of the losses.
    """

    terms: NDArray[np.float64]
    residuals: NDArray[np.float64]
    jacobian: NDArray[np.float64]
    cost: float

    def covariance(self) -> NDArray[np.float64]:
        """Return the (k, k) covariance of the terms, for residuals in their standard errors."""
        return terms_covariance(self.jacobian)


def terms_covariance(jacobian: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (JᵀJ)⁻¹, (k, k), of a Jacobian (n, k); huge along directions that it does not determine.

    JᵀJ has the square of J's condition number: inverting it would lose half of the digits, and possibly all
    of those of the difference of two terms that is known better than either term.
    """
    scale = np.linalg.norm(jacobian, axis=0)
    scale[scale == 0.0] = 1.0
    terms = len(scale)  # zero rows, so that `ways` spans all directions even with fewer rows than terms
    _, sizes, ways = np.linalg.svd(
        np.vstack([jacobian / scale, np.zeros((terms, terms))]), full_matrices=False
    )
    rounding = max(jacobian.shape) * float(np.finfo(np.float64).eps)  # of columns of length 1
    inverse = ways.T / np.maximum(sizes, rounding) / scale[:, None]
    return np.asarray(inverse @ inverse.T, dtype=np.float64)


def fit_least_squares(
    model: ResidualModel, start: NDArray[np.float64], *, loss: Literal["linear", "soft_l1"] = "linear"
) -> LeastSquaresFit:
    """Fit the terms; with `soft_l1`, a residual well beyond 1 counts by its size instead of its square."""
    found = optimize.least_squares(
        model.residuals,
        start,
        jac="2-point" if model.jacobian is None else model.jacobian,
        x_scale="jac" if model.term_scales is None else model.term_scales,
        loss=loss,
    )
    jacobian = np.asarray(found.jac, dtype=np.float64)
    return LeastSquaresFit(terms=found.x, residuals=found.fun, jacobian=jacobian, cost=float(found.cost))


def fit_reweighted(
    model: ResidualModel,
    start: NDArray[np.float64],
    *,
    weights: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    rounds: int,
    stop: float = 0.0,
) -> LeastSquaresFit:
    """Fit with (n,) weights from the last round's residuals, until no term moves by `stop` or more.

    This serves weights that no loss of single residuals gives: of groups, or scaled by the median residual.
    """
    terms = start
    for _ in range(rounds):
        fit = fit_least_squares(_weighted(model, np.sqrt(weights(model.residuals(terms)))), terms)
        moved = float(np.abs(fit.terms - terms).max())
        terms = fit.terms
        if moved < stop:
            break
    return fit


def _weighted(model: ResidualModel, root: NDArray[np.float64]) -> ResidualModel:
    """Return the model with residuals and Jacobian multiplied by (n,) roots of weights."""
    jacobian = model.jacobian
    return ResidualModel(
        residuals=lambda terms: root * model.residuals(terms),
        jacobian=None if jacobian is None else lambda terms: root[:, None] * jacobian(terms),
        term_scales=model.term_scales,
    )
