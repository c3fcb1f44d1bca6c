"""From the places of a drift check to how far each eye has moved, with its uncertainty.

Against the wide camera the mean of the two eyes is known at every place, and between the eyes the rows; how
far apart they see it along the rows is depth as much as drift, and counts only where the depth is known.
Robust least squares with priors: what the places cannot tell stays zero, and its standard error says so.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.drift.drift_turn import TERMS, EyeTurn, slopes, turn_of
from foveacam_pipeline.calibrate.drift.drift_values import DriftPlace, DriftSettings
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.aim import EYES, aim_at

ROUNDS = 30
STOP_RAD = 1e-8
TUKEY = 4.7
"""A place that misses by so many standard errors counts for nothing (Tukey's biweight, 95 % efficient)."""
LEAST_LACK_PX = 0.15
"""No model is trusted to more, whatever it states of itself, fovea px."""
START = 12.0
"""The first rounds forgive this many times more, until the bulk has been found."""
VERGENCE = np.array([0, 1, 0, 0, 0, 0, 0, -1, 0, 0, 0, 0]) / 2.0
"""What of the twelve terms is the angle between the eyes: half the difference of the turns about y."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DriftFit:
    """The twelve terms, left then right, their covariance, and how well the places agree with them.

    `missed`: (n,) how far each place is off, in standard errors of one of its coordinates.
    `residual_px`: root mean square of what the agreeing places leave, fovea px.
    """

    left: EyeTurn
    right: EyeTurn
    covariance: NDArray[np.float64]
    missed: NDArray[np.float64]
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
    """Fit both eyes to all places at once; places that do not agree with the others lose their say."""
    prior = np.diag(1.0 / np.tile(_prior(settings), 2) ** 2)
    terms = _start(places, calibration)
    for count in range(ROUNDS):
        equations = _Equations.of(places, calibration, terms)
        cutoff = TUKEY * max(1.0, START / (1.0 + count))
        weights = equations.weights(cutoff)
        normal = equations.normal(weights) + prior
        step = np.linalg.solve(normal, equations.side(weights) - prior @ terms)
        terms = terms + step
        if cutoff == TUKEY and float(np.abs(step).max()) < STOP_RAD:
            break
    equations = _Equations.of(places, calibration, terms)
    weights = equations.weights(TUKEY)
    covariance = np.linalg.inv(equations.normal(weights) + prior)
    excess = max(1.0, equations.misfit(weights, prior))
    return DriftFit(
        left=turn_of(terms[:TERMS]),
        right=turn_of(terms[TERMS:]),
        covariance=covariance * excess + _common(settings, calibration),
        missed=equations.missed(),
        residual_px=calibration.fovea_f_px * equations.residual_rad(weights),
    )


def field_sigma_rad(
    covariance: NDArray[np.float64], at: NDArray[np.float64], turn: EyeTurn
) -> NDArray[np.float64]:
    """Return (n, 2) standard errors of corrected tangents at (n, 2) calibrated ones; (6, 6) covariance."""
    by_term = slopes(at, turn)
    return np.asarray(np.sqrt(np.einsum("nij,jk,nik->ni", by_term, covariance, by_term)), dtype=np.float64)


def _prior(settings: DriftSettings) -> NDArray[np.float64]:
    turn, roll, stretch = settings.turn_prior_rad, settings.roll_prior_rad, settings.stretch_prior
    return np.array([turn, turn, roll, stretch, stretch, stretch])


def _common(settings: DriftSettings, calibration: Calibration) -> NDArray[np.float64]:
    """Return the (12, 12) covariance of what the wide camera's model lends to both eyes alike."""
    lens = settings.lens_sigma_wide_px / calibration.wide.fx_px
    shared = np.zeros((2 * TERMS, 2 * TERMS))
    for term in (0, 1):
        for row in (term, term + TERMS):
            for column in (term, term + TERMS):
                shared[row, column] = lens**2
    return shared


def _start(places: tuple[DriftPlace, ...], calibration: Calibration) -> NDArray[np.float64]:
    """Return the median shifts as (12,) terms; the angle between the eyes from known depths, if there are."""
    misses = []
    for place in places:
        true = aim_at(calibration, np.array(place.target), _inverse(place, _apart(place), calibration))
        misses.append([true.left - place.seen(Role.LEFT), true.right - place.seen(Role.RIGHT)])
    each = np.array(misses)
    (_, left_y), (_, right_y) = np.median(each, axis=0).tolist()
    across = float(np.median(np.mean(each[:, :, 0], axis=1)))
    told = np.array([place.inverse_depth is not None for place in places])
    apart = float(np.median(each[told, 0, 0] - each[told, 1, 0])) if told.any() else 0.0
    terms = np.zeros(2 * TERMS)
    terms[[0, 1]] = -left_y, across + apart / 2.0
    terms[[TERMS, TERMS + 1]] = -right_y, across - apart / 2.0
    return terms


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Equations:
    """All places against one set of terms.

    `slopes`: (n, 4, 12) and `misses`: (n, 4): the mean of the eyes along x and y, and left minus right along
    x and y, tangents. `sigma`: (n, 4), infinite where a place says nothing.
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
        """Lay the places against the terms."""
        moved, by_term = [], []
        for role, part in ((Role.LEFT, terms[:TERMS]), (Role.RIGHT, terms[TERMS:])):
            turn = turn_of(part)
            tangents = np.array([place.seen(role) for place in places])
            moved.append(turn.apply(tangents))
            by_term.append(slopes(tangents, turn))
        apart = (moved[0] - moved[1])[:, 0]
        true = [
            aim_at(calibration, np.array(place.target), _inverse(place, float(wide), calibration))
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
            sigma=np.array([_sigma(place, calibration) for place in places]),
        )

    def missed(self) -> NDArray[np.float64]:
        """Return (n,) the worst miss of each place, in standard errors."""
        return np.asarray(np.abs(self.misses / self.sigma).max(axis=1), dtype=np.float64)

    def weights(self, cutoff: float) -> NDArray[np.float64]:
        """Return (n,) what each place counts for."""
        inside = np.clip(1.0 - (self.missed() / cutoff) ** 2, 0.0, None)
        return np.asarray(inside**2, dtype=np.float64)

    def normal(self, weights: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the (12, 12) normal matrix."""
        share = weights[:, None] / self.sigma**2
        return np.asarray(np.einsum("nki,nk,nkj->ij", self.slopes, share, self.slopes), dtype=np.float64)

    def side(self, weights: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the (12,) right-hand side."""
        share = weights[:, None] / self.sigma**2
        return np.asarray(np.einsum("nki,nk,nk->i", self.slopes, share, self.misses), dtype=np.float64)

    def misfit(self, weights: NDArray[np.float64], prior: NDArray[np.float64]) -> float:
        """Return what is left over what may be expected, as a variance ratio."""
        left = float(np.sum(weights[:, None] * (self.misses / self.sigma) ** 2))
        told = float(np.sum(weights[:, None] * np.isfinite(self.sigma)))
        normal = self.normal(weights)
        free = told - float(np.trace(np.linalg.solve(normal + prior, normal)))
        return left / free if free > 0.0 else math.inf

    def residual_rad(self, weights: NDArray[np.float64]) -> float:
        """Return the root mean square of what agreeing places leave of the mean of the eyes, one axis."""
        return math.sqrt(float(np.average(np.mean(self.misses[:, :2] ** 2, axis=1), weights=weights)))


def _apart(place: DriftPlace) -> float:
    """Return how far apart along x the eyes see a place, tangents."""
    return place.left[0] - place.right[0]


def _inverse(place: DriftPlace, apart: float, calibration: Calibration) -> float:
    """Return 1/Z, 1/m: as told, or as the eyes have it that see the place so far `apart`."""
    return apart / calibration.baseline_m if place.inverse_depth is None else place.inverse_depth


def _sigma(place: DriftPlace, calibration: Calibration) -> list[float]:
    """Return the standard errors of a place's four equations, with what the mirrors' models lack.

    Along x a model may also state that the angle between its eyes is in doubt; that is being measured here.
    """
    floor = LEAST_LACK_PX / calibration.fovea_f_px
    lack = math.hypot(*(max(floor, min(calibration.eye(role).mirror.sigma_rad)) for role in EYES))
    mean, along, across = place.sigma
    apart = math.inf
    if place.inverse_depth is not None:
        apart = math.hypot(along, lack, calibration.baseline_m * place.inverse_sigma)
    return [math.hypot(mean, lack / 2.0), math.hypot(mean, lack / 2.0), apart, math.hypot(across, lack)]
