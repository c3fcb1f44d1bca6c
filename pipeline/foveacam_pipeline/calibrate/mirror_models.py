"""Models of a mirror, volts to angles, judged against each other by poses that each did not see.

Three kinds stand for election: the paper's cubic (Eq. 3), polynomials of other orders, and springs that
stiffen with few terms for the cross-talk. The winner is handed on as one polynomial, whatever its kind.
"""

import logging
import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.spatial import ConvexHull

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.geometry.polynomial import PolynomialFit, exponents, fit_polynomial
from foveacam_pipeline.models.mirror import MirrorModel

ORDERS = (1, 2, 3, 4, 5, 6, 7, 8, 9)
SPRING_ORDERS = (2, 3, 4, 5, 6)
PAPER_ORDER = 3
SAMPLES_PER_TERM = 3
"""A model with fewer samples a coefficient is not tried: robust weights would serve its noise."""
TOLERANCE = 0.02
"""Of models whose errors differ by less than this share, the one with fewest terms is taken."""
_OUTLIER_SIGMAS = 4.0
_DOMAIN_MARGIN_RAD = math.radians(0.05)
_INVERSE_ORDER = 7
_WRITTEN_ORDER = 11
"""Of the polynomial that writes the springs down: it leaves 1e-7 rad over the calibrated volts."""
_MOST_STIFFENING = 2.0
_STIFFENING_STEP = 1e-3

logger = logging.getLogger(__name__)


class Family(StrEnum):
    """What a model of a mirror is made of."""

    POLYNOMIAL = "polynomial"
    SPRINGS = "springs"
    """Each axis is a spring that stiffens, u + k u^3 = v; a polynomial of (u, u) is what remains."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MirrorScore:
    """One model of one mirror. `rms_rad`, `loo_rad`: (ax, ay) over the poses, seen and left out.

    `terms`: unknowns of an axis. `judged_rad`: what the election compares, outliers capped alike for all.
    """

    name: str
    family: Family
    order: int
    terms: int
    rms_rad: tuple[float, float]
    loo_rad: tuple[float, float]
    judged_rad: float
    chosen: bool = False
    paper: bool = False


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MirrorFit:
    """The elected model of a mirror, the table of all of them, and what it leaves at each pose.

    `residuals_rad`, `loo_residuals_rad`, `weights`: (n, 2), measured minus fitted.
    """

    model: MirrorModel
    scores: tuple[MirrorScore, ...]
    residuals_rad: NDArray[np.float64]
    loo_residuals_rad: NDArray[np.float64]
    weights: NDArray[np.float64]

    @property
    def chosen(self) -> MirrorScore:
        """The score of the elected model."""
        return next(score for score in self.scores if score.chosen)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Candidate:
    family: Family
    stiffening: tuple[float, float]
    max_v: NDArray[np.float64]
    fit: PolynomialFit

    @property
    def order(self) -> int:
        return self.fit.polynomial.order

    @property
    def terms(self) -> int:
        return len(exponents(self.order)) + (self.family is Family.SPRINGS)

    def __call__(self, volts_v: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the angles (n, 2), rad, of volts (n, 2)."""
        if self.family is Family.POLYNOMIAL:
            return self.fit.polynomial(volts_v)
        return self.fit.polynomial(stretched(volts_v / self.max_v, self.stiffening))


def fit_mirror_models(
    volts_v: NDArray[np.float64],
    angles_rad: NDArray[np.float64],
    *,
    orders: tuple[int, ...] = ORDERS,
    spring_orders: tuple[int, ...] = SPRING_ORDERS,
) -> MirrorFit:
    """Fit every model with samples enough to (n, 2) volts and gaze angles, rad, and elect one."""
    candidates = _candidates(volts_v, angles_rad, orders, spring_orders)
    judged = _judged_rad(candidates)
    limit = min(judged) * (1.0 + TOLERANCE)
    fitting = [k for k, error in enumerate(judged) if error <= limit]
    elected = min(fitting, key=lambda k: candidates[k].terms)
    scores = tuple(
        _score(candidate, error, chosen=k == elected)
        for k, (candidate, error) in enumerate(zip(candidates, judged, strict=True))
    )
    fit = candidates[elected].fit
    logger.info(
        "mirror: %s, left out %.4f and %.4f deg",
        scores[elected].name,
        *(math.degrees(v) for v in scores[elected].loo_rad),
    )
    return MirrorFit(
        model=_written(candidates[elected], volts_v, angles_rad),
        scores=scores,
        residuals_rad=fit.residuals,
        loo_residuals_rad=fit.loo_residuals,
        weights=fit.weights,
    )


def fit_mirror(
    volts_v: NDArray[np.float64], angles_rad: NDArray[np.float64], *, orders: tuple[int, ...] = ORDERS
) -> MirrorModel:
    """Fit a mirror to (n, 2) volts and the (n, 2) gaze angles, rad, measured under them."""
    return fit_mirror_models(volts_v, angles_rad, orders=orders).model


def stretched(share: NDArray[np.float64], stiffening: tuple[float, float]) -> NDArray[np.float64]:
    """Return (n, 2) deflections u of springs with u + k u^3 = `share`: (n, 2), k >= 0 for each axis."""
    columns = []
    for drive, k in zip(share.T, stiffening, strict=True):
        if k < 1e-9:
            columns.append(drive)
            continue
        scale = math.sqrt(1.0 / (3.0 * k))  # the one real root of a cubic without turning points
        columns.append(2.0 * scale * np.sinh(np.arcsinh(drive / (2.0 * k * scale**3)) / 3.0))
    return np.column_stack(columns)


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
            family=Family.POLYNOMIAL,
            stiffening=(0.0, 0.0),
            max_v=max_v,
            fit=fit_polynomial(volts_v, angles_rad, order),
        )
        for order in sorted(orders)
        if len(exponents(order)) <= rooms
    ]
    if not found:
        fit_polynomial(volts_v, angles_rad, min(orders))  # raises with the number of samples needed
        raise InvalidInput(
            f"mirror: {len(volts_v)} poses are too few for {SAMPLES_PER_TERM} a coefficient; add poses"
        )
    stiff = [order for order in sorted(spring_orders) if len(exponents(order)) + 1 <= rooms]
    return found + [_springs(volts_v, angles_rad, max_v, order) for order in stiff]


def _springs(
    volts_v: NDArray[np.float64], angles_rad: NDArray[np.float64], max_v: NDArray[np.float64], order: int
) -> _Candidate:
    """Return the springs whose stiffening leaves a polynomial of this order the least to do."""
    share = volts_v / max_v

    def squares(kx: float, ky: float) -> float:
        fit = fit_polynomial(stretched(share, (max(kx, 0.0), max(ky, 0.0))), angles_rad, order, "square")
        return float(np.sum(fit.residuals**2))

    start = np.full(2, 0.15, dtype=np.float64)  # a tenth less reach at full drive than the slope at rest promises
    scale = max(squares(0.15, 0.15), 1e-300)
    found = minimize(
        lambda k: squares(float(k[0]), float(k[1])) / scale, start, method="Nelder-Mead", tol=_STIFFENING_STEP
    )
    kx, ky = np.clip(found.x, 0.0, _MOST_STIFFENING).tolist()
    return _Candidate(
        family=Family.SPRINGS,
        stiffening=(kx, ky),
        max_v=max_v,
        fit=fit_polynomial(stretched(share, (kx, ky)), angles_rad, order),
    )


def _judged_rad(candidates: list[_Candidate]) -> list[float]:
    """Return each model's leave-one-out error, with one limit for all: none hides its misses as outliers."""
    misses = [np.abs(candidate.fit.loo_residuals) for candidate in candidates]
    cap = _OUTLIER_SIGMAS * 1.4826 * np.min([np.median(m, axis=0) for m in misses], axis=0)
    return [float(np.sqrt(np.mean(np.minimum(m, cap) ** 2))) for m in misses]


def _score(candidate: _Candidate, judged_rad: float, *, chosen: bool) -> MirrorScore:
    polynomial = candidate.family is Family.POLYNOMIAL
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


def _written(
    candidate: _Candidate, volts_v: NDArray[np.float64], angles_rad: NDArray[np.float64]
) -> MirrorModel:
    """Return the model of the product: one forward polynomial, a start for its inverse, and the domain."""
    line = np.sin(np.linspace(-0.5, 0.5, 33) * math.pi)  # dense at the rim, where a polynomial swings
    grid = np.array([(x, y) for x in line for y in line]) * candidate.max_v
    forward = candidate.fit.polynomial
    if candidate.family is Family.SPRINGS:
        forward = fit_polynomial(grid, candidate(grid), _WRITTEN_ORDER, "square").polynomial
    sigma = _model_sigma(candidate, volts_v, angles_rad)
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


def _model_sigma(
    candidate: _Candidate, volts_v: NDArray[np.float64], angles_rad: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the (2,) standard error of a predicted angle: of the coefficients, and of what the order lacks.

    A fit two orders higher shows how much of the scatter is structure that the model leaves behind.
    """
    variance = candidate.fit.scatter**2
    parameters = candidate.terms / len(volts_v)
    richer = candidate.order + 2
    lack = np.zeros_like(variance)
    if len(exponents(richer)) * 2 <= len(volts_v):
        drive = stretched(volts_v / candidate.max_v, candidate.stiffening)
        lack = np.maximum(0.0, variance - fit_polynomial(drive, angles_rad, richer).scatter ** 2)
    sigma: NDArray[np.float64] = np.sqrt(variance * parameters + lack)
    return sigma


def hull_of(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (m, 2) corners of the convex hull of (n, 2) directions, anticlockwise in (ax, ay)."""
    return np.asarray(angles[ConvexHull(angles).vertices], dtype=np.float64)
