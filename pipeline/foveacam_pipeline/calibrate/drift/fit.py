"""Fit of the turn of both eyes to the places of a drift check, with its covariance.

At every place the wide camera gives the mean of the two eyes, and the eyes give their row difference. Their
difference along the rows mixes depth and drift, so it counts only where the depth is known. The fit is robust
least squares with priors: what the places do not determine stays zero, with the prior as its standard error.
"""

import math
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.drift.values import (
    TERMS,
    DriftPlace,
    DriftSettings,
    EyeDrift,
    EyeTurn,
    turn_from_terms,
    turn_slopes,
)
from foveacam_pipeline.calibrate.robust_least_squares import ResidualModel, fit_reweighted
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.aim import EYES, aim_at

ROUNDS = 30
STOP_RAD = 1e-8
TUKEY_CUTOFF = 4.7
"""Residual, in standard errors, from which a place has no weight (Tukey's biweight, 95 % efficient)."""
MIN_MODEL_SIGMA_PX = 0.15
"""Lower limit of the standard error of a mirror's model, whatever the model states, fovea px."""
START_FACTORS = 12.0 / np.arange(1.0, 12.0)
"""Factors on the cutoff, one for each of the first rounds, so that the majority is found first."""
VERGENCE = np.array([0, 1, 0, 0, 0, 0, 0, -1, 0, 0, 0, 0]) / 2.0
"""Weights of the twelve terms in half the angle between the eyes: half the difference of the turns about
y."""
FIELD_KNOTS = 9
HEIGHT_SIGMAS = 3.0
"""The eyes' difference in height is corrected alone when it exceeds this many of its standard errors."""
HEIGHT = np.array([1, 0, 0, 0, 0, 0, -1, 0, 0, 0, 0, 0]) / 2.0
"""Weights of the twelve terms in that difference: half the difference of the turns about x."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DriftFit:
    """The twelve terms, left then right, their covariance, and the residuals of the places.

    `miss_sigmas`: (n,) worst residual of each place, in standard errors of that coordinate.
    `residual_px`: root mean square residual of the agreeing places, fovea px.
    """

    left: EyeTurn
    right: EyeTurn
    covariance: NDArray[np.float64]
    miss_sigmas: NDArray[np.float64]
    residual_px: float

    @property
    def terms(self) -> NDArray[np.float64]:
        """(12,) turn and stretch of the left, then of the right eye."""
        return np.concatenate([self.left.terms, self.right.terms])

    @property
    def vergence_sigma_rad(self) -> float:
        """Standard error of half the angle between the eyes."""
        return math.sqrt(float(VERGENCE @ self.covariance @ VERGENCE))


def fit_drift(places: tuple[DriftPlace, ...], calibration: Calibration, settings: DriftSettings) -> DriftFit:
    """Fit the drift of both eyes to all places by robust least squares; outliers get no weight."""
    prior_sigmas = np.tile(_prior_sigmas(settings), 2)
    equations_at = _LastEquations(places, calibration)
    model = ResidualModel(
        residuals=lambda terms: np.append(-equations_at(terms).miss_ratios(), terms / prior_sigmas),
        jacobian=lambda terms: np.vstack([equations_at(terms).slope_ratios(), np.diag(1.0 / prior_sigmas)]),
    )
    terms = _start_terms(places, calibration)
    for factor in START_FACTORS:
        weights = partial(_residual_weights, cutoff=factor * TUKEY_CUTOFF)
        terms = fit_reweighted(model, terms, weights=weights, rounds=1).terms
    fit = fit_reweighted(model, terms, weights=_residual_weights, rounds=ROUNDS, stop=STOP_RAD)
    equations, covariance = equations_at(fit.terms), fit.covariance()
    free_terms = 2 * TERMS - float(np.sum(np.diag(covariance) / prior_sigmas**2))
    excess = max(1.0, equations.misfit(free_terms))
    return DriftFit(
        left=turn_from_terms(fit.terms[:TERMS]),
        right=turn_from_terms(fit.terms[TERMS:]),
        covariance=covariance * excess + _lens_covariance(settings, calibration),
        miss_sigmas=equations.miss_sigmas(),
        residual_px=calibration.fovea_f_px * equations.residual_rad(),
    )


class _LastEquations:
    """The equations of the places at given terms, cached because a fit evaluates the same terms twice."""

    def __init__(self, places: tuple[DriftPlace, ...], calibration: Calibration) -> None:
        self._places, self._calibration = places, calibration
        self._last: tuple[bytes, _Equations] | None = None

    def __call__(self, terms: NDArray[np.float64]) -> "_Equations":
        key = terms.tobytes()
        if self._last is None or self._last[0] != key:
            self._last = key, _Equations.of(self._places, self._calibration, terms)
        return self._last[1]


def _residual_weights(residuals: NDArray[np.float64], *, cutoff: float = TUKEY_CUTOFF) -> NDArray[np.float64]:
    """Return Tukey's weights of the places, four residuals each by their worst, and 1 for the priors."""
    worst = np.abs(residuals[: -2 * TERMS].reshape(-1, 4)).max(axis=1)
    return np.append(np.repeat(_tukey_weights(worst, cutoff), 4), np.ones(2 * TERMS))


def _tukey_weights(miss_sigmas: NDArray[np.float64], cutoff: float = TUKEY_CUTOFF) -> NDArray[np.float64]:
    return np.asarray(np.clip(1.0 - (miss_sigmas / cutoff) ** 2, 0.0, None) ** 2, dtype=np.float64)


def field_sigma_rad(
    covariance: NDArray[np.float64], at: NDArray[np.float64], turn: EyeTurn
) -> NDArray[np.float64]:
    """Return (n, 2) standard errors of corrected tangents at (n, 2) calibrated ones; (6, 6) covariance."""
    by_term = turn_slopes(at, turn)
    return np.asarray(np.sqrt(np.einsum("nij,jk,nik->ni", by_term, covariance, by_term)), dtype=np.float64)


def _prior_sigmas(settings: DriftSettings) -> NDArray[np.float64]:
    turn, roll, stretch = settings.turn_prior_rad, settings.roll_prior_rad, settings.stretch_prior
    return np.array([turn, turn, roll, stretch, stretch, stretch])


def _lens_covariance(settings: DriftSettings, calibration: Calibration) -> NDArray[np.float64]:
    """Return the (12, 12) covariance from the wide camera's model error, which both eyes share."""
    lens = settings.lens_sigma_wide_px / calibration.wide.fx_px
    shared = np.zeros((2 * TERMS, 2 * TERMS))
    for term in (0, 1):
        for row in (term, term + TERMS):
            for column in (term, term + TERMS):
                shared[row, column] = lens**2
    return shared


def _start_terms(places: tuple[DriftPlace, ...], calibration: Calibration) -> NDArray[np.float64]:
    """Return the median shifts as (12,) terms; known depths, if any, give the angle between the eyes."""
    misses = []
    for place in places:
        true = aim_at(
            calibration, np.array(place.target), _inverse_depth(place, _seen_apart(place), calibration)
        )
        misses.append([true.left - place.seen(Role.LEFT), true.right - place.seen(Role.RIGHT)])
    each = np.array(misses)
    (_, left_y), (_, right_y) = np.median(each, axis=0).tolist()
    across = float(np.median(np.mean(each[:, :, 0], axis=1)))
    known = np.array([place.inverse_depth is not None for place in places])
    apart = float(np.median(each[known, 0, 0] - each[known, 1, 0])) if known.any() else 0.0
    terms = np.zeros(2 * TERMS)
    terms[[0, 1]] = -left_y, across + apart / 2.0
    terms[[TERMS, TERMS + 1]] = -right_y, across - apart / 2.0
    return terms


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Equations:
    """The equations of all places, linearised at one set of terms.

    `slopes`: (n, 4, 12) and `misses`: (n, 4): the mean of the eyes along x and y, and left minus right along
    x and y, tangents. `sigma`: (n, 4), infinite where a place gives no information.
    """

    slopes: NDArray[np.float64]
    misses: NDArray[np.float64]
    sigma: NDArray[np.float64]

    @classmethod
    def of(
        cls,
        places: tuple[DriftPlace, ...],
        calibration: Calibration,
        terms: NDArray[np.float64],
    ) -> "_Equations":
        """Linearise the equations of the places at the terms."""
        moved, by_term = [], []
        for role, part in ((Role.LEFT, terms[:TERMS]), (Role.RIGHT, terms[TERMS:])):
            turn = turn_from_terms(part)
            tangents = np.array([place.seen(role) for place in places])
            moved.append(turn.apply(tangents))
            by_term.append(turn_slopes(tangents, turn))
        apart = (moved[0] - moved[1])[:, 0]
        true = [
            aim_at(calibration, np.array(place.target), _inverse_depth(place, float(wide), calibration))
            for place, wide in zip(places, apart, strict=True)
        ]
        misses = [
            np.array([gaze.left for gaze in true]) - moved[0],
            np.array([g.right for g in true]) - moved[1],
        ]
        zero = np.zeros_like(by_term[0])
        left, right = np.concatenate([by_term[0], zero], axis=2), np.concatenate([zero, by_term[1]], axis=2)
        return cls(
            slopes=np.concatenate([(left + right) / 2.0, left - right], axis=1),
            misses=np.concatenate([(misses[0] + misses[1]) / 2.0, misses[0] - misses[1]], axis=1),
            sigma=np.array([_place_sigmas(place, calibration) for place in places]),
        )

    def miss_ratios(self) -> NDArray[np.float64]:
        """Return the (4 n,) misses in standard errors."""
        return np.asarray((self.misses / self.sigma).ravel(), dtype=np.float64)

    def slope_ratios(self) -> NDArray[np.float64]:
        """Return the (4 n, 12) slopes over the standard errors of the misses."""
        return np.asarray((self.slopes / self.sigma[..., None]).reshape(-1, 2 * TERMS), dtype=np.float64)

    def miss_sigmas(self) -> NDArray[np.float64]:
        """Return the (n,) worst residual of each place, in standard errors."""
        return np.asarray(np.abs(self.misses / self.sigma).max(axis=1), dtype=np.float64)

    def misfit(self, free_terms: float) -> float:
        """Return the reduced chi-square: squared residuals over what their standard errors predict.

        `free_terms`: the terms that the places determine, without the share of the priors.
        """
        weights = _tukey_weights(self.miss_sigmas())[:, None]
        free = float(np.sum(weights * np.isfinite(self.sigma))) - free_terms
        return float(np.sum(weights * (self.misses / self.sigma) ** 2)) / free if free > 0.0 else math.inf

    def residual_rad(self) -> float:
        """Return the root mean square residual of the mean of the eyes at agreeing places, one axis."""
        weights = _tukey_weights(self.miss_sigmas())
        return math.sqrt(float(np.average(np.mean(self.misses[:, :2] ** 2, axis=1), weights=weights)))


def _seen_apart(place: DriftPlace) -> float:
    """Return the difference along x at which the eyes see a place, tangents."""
    return place.left[0] - place.right[0]


def _inverse_depth(place: DriftPlace, apart: float, calibration: Calibration) -> float:
    """Return the known inverse depth, 1/m, or the one by the difference `apart` between the eyes."""
    return apart / calibration.baseline_m if place.inverse_depth is None else place.inverse_depth


def _place_sigmas(place: DriftPlace, calibration: Calibration) -> list[float]:
    """Return the standard errors of a place's four equations, the error of the mirrors' models included.

    That error is the smaller of the two axes: along x a model may also state an unknown angle between its
    eyes, which is measured here.
    """
    floor = MIN_MODEL_SIGMA_PX / calibration.fovea_f_px
    lack = math.hypot(*(max(floor, min(calibration.eye(role).mirror.sigma_rad)) for role in EYES))
    mean, along, across = place.sigma
    apart = math.inf
    if place.inverse_depth is not None:
        apart = math.hypot(along, lack, calibration.baseline_m * place.inverse_sigma)
    return [math.hypot(mean, lack / 2.0), math.hypot(mean, lack / 2.0), apart, math.hypot(across, lack)]


def eye_drifts(
    terms: NDArray[np.float64],
    covariance: NDArray[np.float64],
    calibration: Calibration,
    settings: DriftSettings,
) -> tuple[EyeDrift, EyeDrift]:
    """Return the drift of the left and of the right eye, from (12,) terms and their (12, 12) covariance."""
    left, right = slice(0, TERMS), slice(TERMS, 2 * TERMS)
    return (
        _eye_drift(terms[left], covariance[left, left], calibration, Role.LEFT, settings),
        _eye_drift(terms[right], covariance[right, right], calibration, Role.RIGHT, settings),
    )


def _eye_drift(
    terms: NDArray[np.float64],
    covariance: NDArray[np.float64],
    calibration: Calibration,
    role: Role,
    settings: DriftSettings,
) -> EyeDrift:
    turn = turn_from_terms(terms)
    field = field_tangents(calibration, role)
    f_px = calibration.fovea_f_px
    moved_px = f_px * _rms2(turn.apply(field) - field)
    sigma_px = f_px * _rms2(field_sigma_rad(covariance, field, turn))
    sigmas = np.sqrt(np.diag(covariance))
    return EyeDrift(
        turn=turn,
        shift_sigma_rad=(float(sigmas[1]), float(sigmas[0])),
        roll_sigma_rad=float(sigmas[2]),
        moved_px=moved_px,
        sigma_px=sigma_px,
        significant=moved_px > settings.significant * sigma_px,
    )


def field_tangents(calibration: Calibration, role: Role) -> NDArray[np.float64]:
    """Return (n, 2) tangents on a grid over an eye's field of regard."""
    hull = calibration.eye(role).mirror.hull_rad
    xs, ys = (np.linspace(hull[:, k].min(), hull[:, k].max(), FIELD_KNOTS) for k in (0, 1))
    return np.tan(np.array([(x, y) for x in xs for y in ys], dtype=np.float64))


def _rms2(vectors: NDArray[np.float64]) -> float:
    """Return the root mean square length of (n, 2) vectors."""
    return math.sqrt(float(np.mean(np.sum(vectors**2, axis=1))))


def vertical_offset_terms(fit: DriftFit) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    """Return (12,) terms that correct only the eyes' difference in height, and their covariance.

    Return None where that difference is within its error. It is known several times better than where each
    eye looks: both see the same point, so the errors of the wide camera and its lens cancel. A pixel, as
    mounts drift in minutes, is within the error of each eye's own correction but far beyond the error of the
    difference, which decides the rows of rectified pairs and the health of a calibration.
    """
    half = float(HEIGHT @ fit.terms)
    sigma = math.sqrt(float(HEIGHT @ fit.covariance @ HEIGHT))
    if abs(half) <= HEIGHT_SIGMAS * sigma:
        return None
    each = 2.0 * HEIGHT
    return half * each, sigma**2 * np.outer(each, each)
