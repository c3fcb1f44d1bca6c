"""Models of a mirror, volts to angles, chosen by their error at poses left out of the fit.

There are three kinds: the paper's cubic (Eq. 3), polynomials of other orders, and stiffening springs, u + k
u^3 = v on each axis with drive v and deflection u as shares, followed by a low-order polynomial: springs
describe the saturation, the polynomial the cross-talk and the optics. The result is always one polynomial.
"""

import logging
import math
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.spatial import ConvexHull

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.geometry.polynomial import PolynomialFit, exponents, fit_polynomial, monomials
from foveacam_pipeline.models.mirror import MirrorModel

START_STIFFENING = 0.15
"""Start value of a spring's stiffening k: about a tenth less reach than the slope at rest predicts."""
_MAX_STIFFENING = 2.0
_STIFFENING_TOLERANCE = 1e-5
ORDERS = (1, 2, 3, 4, 5, 6, 7, 8, 9)
SPRING_ORDERS = (2, 3, 4, 5, 6, 7)
PAPER_ORDER = 3
SAMPLES_PER_TERM = 3
"""Minimum samples a coefficient: with fewer, robust weights would fit the noise."""
TOLERANCE = 0.02
"""Among models whose errors differ by less than this share, the one with fewest terms is chosen."""
_OUTLIER_SIGMAS = 4.0
_DOMAIN_MARGIN_RAD = math.radians(0.05)
_INVERSE_ORDER = 7
_WRITTEN_ORDER = 11
"""Order of the polynomial that replaces the springs: it leaves 1e-7 rad over the calibrated volts."""

logger = logging.getLogger(__name__)


def spring_deflection(share: NDArray[np.float64], stiffening: tuple[float, float]) -> NDArray[np.float64]:
    """Return the (n, 2) deflections u of springs, u + k u^3 = `share` (n, 2), with k >= 0 for each axis."""
    columns = []
    for drive, k in zip(share.T, stiffening, strict=True):
        if k < 1e-9:
            columns.append(drive)
            continue
        scale = math.sqrt(1.0 / (3.0 * k))  # the one real root of a cubic without turning points
        columns.append(2.0 * scale * np.sinh(np.arcsinh(drive / (2.0 * k * scale**3)) / 3.0))
    return np.column_stack(columns)


def fit_stiffening(
    share: NDArray[np.float64], angles_rad: NDArray[np.float64], *, order: int
) -> tuple[float, float]:
    """Return the k of both axes for which a polynomial of `order` leaves the smallest residuals.

    `share`: (n, 2) drive over the largest. `angles_rad`: (n, 2).
    """

    def squares(stiffening: NDArray[np.float64]) -> float:
        kx, ky = np.maximum(stiffening, 0.0).tolist()
        drive = spring_deflection(share, (kx, ky))
        basis = monomials(drive[:, 0], drive[:, 1], order)
        solution = np.linalg.solve(basis.T @ basis, basis.T @ angles_rad)  # exact enough
        return float(np.sum((angles_rad - basis @ solution) ** 2))

    start = np.array([START_STIFFENING, START_STIFFENING])
    scale = max(squares(start), 1e-300)

    def share_left(stiffening: NDArray[np.float64]) -> float:
        return squares(stiffening) / scale

    found = minimize(share_left, start, method="Nelder-Mead", tol=_STIFFENING_TOLERANCE)
    kx, ky = np.clip(found.x, 0.0, _MAX_STIFFENING).tolist()
    return kx, ky


class MirrorModelFamily(StrEnum):
    """Kind of a mirror model."""

    POLYNOMIAL = "polynomial"
    SPRINGS = "springs"
    """Each axis is a stiffening spring, u + k u^3 = v, followed by a polynomial of both deflections."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MirrorScore:
    """Scores of one model of one mirror. `rms_rad`, `loo_rad`: (ax, ay) over the poses, fitted and left out.

    `terms`: unknowns of an axis. `judged_rad`: error that decides the choice, outliers capped alike for all.
    """

    name: str
    family: MirrorModelFamily
    order: int
    terms: int
    rms_rad: tuple[float, float]
    loo_rad: tuple[float, float]
    judged_rad: float
    chosen: bool = False
    paper: bool = False


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MirrorFit:
    """The chosen model of a mirror, the scores of all candidates, and its residuals at each pose.

    `loo_residuals_rad`, `weights`: (n, 2), measured minus fitted.
    """

    model: MirrorModel
    scores: tuple[MirrorScore, ...]
    loo_residuals_rad: NDArray[np.float64]
    weights: NDArray[np.float64]

    @property
    def chosen(self) -> MirrorScore:
        """The score of the chosen model."""
        return next(score for score in self.scores if score.chosen)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Candidate:
    family: MirrorModelFamily
    stiffening: tuple[float, float]
    max_v: NDArray[np.float64]
    fit: PolynomialFit

    @property
    def order(self) -> int:
        return self.fit.polynomial.order

    @property
    def terms(self) -> int:
        return len(exponents(self.order)) + (self.family is MirrorModelFamily.SPRINGS)

    def drive(self, volts_v: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the (n, 2) arguments of the polynomial for volts (n, 2)."""
        if self.family is MirrorModelFamily.POLYNOMIAL:
            return volts_v
        return spring_deflection(volts_v / self.max_v, self.stiffening)

    def __call__(self, volts_v: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the angles (n, 2), rad, of volts (n, 2)."""
        return self.fit.polynomial(self.drive(volts_v))


def fit_mirror_models(
    volts_v: NDArray[np.float64],
    angles_rad: NDArray[np.float64],
    *,
    group: NDArray[np.int64] | None = None,
    orders: tuple[int, ...] = ORDERS,
    spring_orders: tuple[int, ...] = SPRING_ORDERS,
) -> MirrorFit:
    """Fit every model that has enough samples to (n, 2) volts and gaze angles, rad, and choose one.

    `group`: (n,), samples with the same number are left out together. Otherwise a node swept at two distances
    would predict itself, and an order high enough to pass through all nodes would be chosen.
    """
    candidates = _candidates(volts_v, angles_rad, orders, spring_orders)
    if group is not None:
        candidates = [replace(c, fit=_left_out_together(c, volts_v, group)) for c in candidates]
    judged = _election_errors_rad(candidates)
    limit = min(judged) * (1.0 + TOLERANCE)
    fitting = [k for k, error in enumerate(judged) if error <= limit]
    best = min(fitting, key=lambda k: candidates[k].terms)
    scores = tuple(
        _score(candidate, error, chosen=k == best)
        for k, (candidate, error) in enumerate(zip(candidates, judged, strict=True))
    )
    fit = candidates[best].fit
    logger.info(
        "mirror: %s, left out %.4f and %.4f deg",
        scores[best].name,
        *(math.degrees(v) for v in scores[best].loo_rad),
    )
    return MirrorFit(
        model=_as_mirror_model(candidates[best], volts_v, angles_rad),
        scores=scores,
        loo_residuals_rad=fit.loo_residuals,
        weights=fit.weights,
    )


def _candidates(
    volts_v: NDArray[np.float64],
    angles_rad: NDArray[np.float64],
    orders: tuple[int, ...],
    spring_orders: tuple[int, ...],
) -> list[_Candidate]:
    max_v = np.abs(volts_v).max(axis=0)
    if not (max_v > 0.0).all():
        raise InvalidInput(
            f"mirror: the volts reach only ({max_v[0]:g}, {max_v[1]:g}) V; drive both axes and sweep again"
        )
    rooms = len(volts_v) // SAMPLES_PER_TERM
    found = [
        _Candidate(
            family=MirrorModelFamily.POLYNOMIAL,
            stiffening=(0.0, 0.0),
            max_v=max_v,
            fit=fit_polynomial(volts_v, angles_rad, order),
        )
        for order in sorted(orders)
        if len(exponents(order)) <= rooms
    ]
    stiff = [order for order in sorted(spring_orders) if len(exponents(order)) + 1 <= rooms]
    found += [_spring_candidate(volts_v, angles_rad, max_v, order) for order in stiff]
    if not found:
        fewest = min((*orders, *spring_orders))
        raise InvalidInput(
            f"mirror: {len(volts_v)} poses are too few, order {fewest} needs "
            f"{SAMPLES_PER_TERM * len(exponents(fewest))}; add poses or lower the order"
        )
    return found


def _left_out_together(
    candidate: _Candidate, volts_v: NDArray[np.float64], group: NDArray[np.int64]
) -> PolynomialFit:
    """Return the fit with leave-one-group-out residuals, (I - H_gg)^-1 r_g."""
    fit = candidate.fit
    basis = np.linalg.qr(fit.polynomial.basis(candidate.drive(volts_v)))[0]
    left_out = np.empty_like(fit.residuals)
    for axis in (0, 1):
        weights, residuals = fit.weights[:, axis], fit.residuals[:, axis]
        reach = np.linalg.inv(basis.T @ (basis * weights[:, None]))
        for number in np.unique(group):
            rows = np.flatnonzero(group == number)
            hat = basis[rows] @ reach @ (basis[rows] * weights[rows, None]).T
            left_out[rows, axis] = np.linalg.lstsq(np.eye(len(rows)) - hat, residuals[rows], rcond=1e-9)[0]
    return replace(fit, loo_residuals=left_out)


def _spring_candidate(
    volts_v: NDArray[np.float64], angles_rad: NDArray[np.float64], max_v: NDArray[np.float64], order: int
) -> _Candidate:
    stiffening = fit_stiffening(volts_v / max_v, angles_rad, order=order)
    drive = spring_deflection(volts_v / max_v, stiffening)
    fit = fit_polynomial(drive, angles_rad, order)
    return _Candidate(family=MirrorModelFamily.SPRINGS, stiffening=stiffening, max_v=max_v, fit=fit)


def _election_errors_rad(candidates: list[_Candidate]) -> list[float]:
    """Return each model's leave-one-out error, outliers capped at one limit for all models."""
    misses = [np.abs(candidate.fit.loo_residuals) for candidate in candidates]
    cap = _OUTLIER_SIGMAS * 1.4826 * np.min([np.median(m, axis=0) for m in misses], axis=0)
    return [float(np.sqrt(np.mean(np.minimum(m, cap) ** 2))) for m in misses]


def _score(candidate: _Candidate, judged_rad: float, *, chosen: bool) -> MirrorScore:
    polynomial = candidate.family is MirrorModelFamily.POLYNOMIAL
    rms, loo = candidate.fit.rms.tolist(), candidate.fit.loo_rms.tolist()
    return MirrorScore(
        name=f"order {candidate.order}" if polynomial else f"springs + order {candidate.order}",
        family=candidate.family,
        order=candidate.order,
        terms=candidate.terms,
        rms_rad=(rms[0], rms[1]),
        loo_rad=(loo[0], loo[1]),
        judged_rad=judged_rad,
        chosen=chosen,
        paper=polynomial and candidate.order == PAPER_ORDER,
    )


def _as_mirror_model(
    candidate: _Candidate, volts_v: NDArray[np.float64], angles_rad: NDArray[np.float64]
) -> MirrorModel:
    """Return the candidate as a MirrorModel: forward polynomial, start of its inverse, and domain."""
    line = np.sin(np.linspace(-0.5, 0.5, 33) * math.pi)  # dense at the rim, where a polynomial swings
    grid = np.array([(x, y) for x in line for y in line]) * candidate.max_v
    forward = candidate.fit.polynomial
    if candidate.family is MirrorModelFamily.SPRINGS:
        forward = fit_polynomial(grid, candidate(grid), _WRITTEN_ORDER, "square").polynomial
    sigma = _model_sigma(candidate, len(volts_v))
    loo = candidate.fit.loo_rms
    return MirrorModel(
        forward=forward,
        inverse=fit_polynomial(forward(grid), grid, _INVERSE_ORDER, "square").polynomial,
        hull_rad=hull_of(forward(volts_v)),
        margin_rad=_DOMAIN_MARGIN_RAD,
        max_v=(float(candidate.max_v[0]), float(candidate.max_v[1])),
        sigma_rad=(float(sigma[0]), float(sigma[1])),
        loo_rad=(float(loo[0]), float(loo[1])),
    )


def _model_sigma(candidate: _Candidate, poses: int) -> NDArray[np.float64]:
    """Return the (2,) standard error of the angle that a move reaches, of a fit to so many poses.

    It is the error of the coefficients and the scatter about them, which has what the model does not describe
    and what differs from move to move. Noise of the measurement counts as scatter; it is small beside it.
    """
    sigma: NDArray[np.float64] = candidate.fit.scatter * math.sqrt(1.0 + candidate.terms / poses)
    return sigma


def hull_of(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (m, 2) corners of the convex hull of (n, 2) directions, anticlockwise in (ax, ay)."""
    return np.asarray(angles[ConvexHull(angles).vertices], dtype=np.float64)
