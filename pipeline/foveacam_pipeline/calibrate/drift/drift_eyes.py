"""How far each eye has moved over its field of regard, from the terms of a fit and their covariance."""

import math

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.drift.drift_fit import field_sigma_rad
from foveacam_pipeline.calibrate.drift.drift_turn import TERMS, turn_of
from foveacam_pipeline.calibrate.drift.drift_values import DriftSettings, EyeDrift
from foveacam_pipeline.models.calibration import Calibration

FIELD_KNOTS = 9


def eye_drifts(
    terms: NDArray[np.float64],
    covariance: NDArray[np.float64],
    calibration: Calibration,
    settings: DriftSettings,
) -> tuple[EyeDrift, EyeDrift]:
    """Return left and right, from (12,) terms and their (12, 12) covariance."""
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
    turn = turn_of(terms)
    field = field_of(calibration, role)
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


def field_of(calibration: Calibration, role: Role) -> NDArray[np.float64]:
    """Return (n, 2) tangents all over an eye's field of regard."""
    hull = calibration.eye(role).mirror.hull_rad
    xs, ys = (np.linspace(hull[:, k].min(), hull[:, k].max(), FIELD_KNOTS) for k in (0, 1))
    return np.tan(np.array([(x, y) for x in xs for y in ys], dtype=np.float64))


def _rms2(vectors: NDArray[np.float64]) -> float:
    """Return the root mean square length of (n, 2) vectors."""
    return math.sqrt(float(np.mean(np.sum(vectors**2, axis=1))))
