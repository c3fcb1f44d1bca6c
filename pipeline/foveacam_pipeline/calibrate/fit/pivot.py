"""Fit of the pivot from which gazes leave, by the change of directions with the target's depth.

Thermal drift of a mount between two sweeps has the same effect. Nodes that were visited again separate the
two (`mount_drift`); without them the drift is not corrected, and its usual size is part of the standard
error.
"""

import logging
import math
from dataclasses import dataclass

import numpy as np

from foveacam_pipeline.calibrate.fit.mirror_models import ORDERS
from foveacam_pipeline.calibrate.fit.samples import EyeSweep
from foveacam_pipeline.calibrate.robust_least_squares import terms_covariance
from foveacam_pipeline.geometry.polynomial import fit_best_order, least_squares

PIVOT_TOLERANCE_M = 0.4e-3
"""Assembly tolerance of the pivot, assumed where a sweep at one depth cannot measure it (deduced: tenths of a
millimetre in the mount and in the lens)."""
DRIFT_RAD = math.radians(0.0014)
"""Deviation of a mount from its state during calibration, rms over the ten minutes afterwards, as mounts of
the simulated rig have it. Assumed, and stated by a calibration, where the drift was not measured because no
nodes were visited again, as in sweeps of earlier versions or of other programs."""
DRIFT_RAD_PER_S = math.radians(0.002) / 300.0
"""Usual drift of a mount where it was not measured (deduced: a fovea px in some minutes, Sec. 3.3)."""

logger = logging.getLogger(__name__)


def mount_sigma_rad(sweep: EyeSweep) -> tuple[float, float]:
    """Return the mount's drift, across and down, that a calibration states: measured, else assumed."""
    return (DRIFT_RAD, DRIFT_RAD) if sweep.drift is None else sweep.drift.stated_rad


@dataclass(frozen=True, slots=True, kw_only=True)
class PivotFit:
    """Pivot of a gaze, from the eye's reference point, m, and the standard error of its x and y."""

    offset_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    sigma_m: float = PIVOT_TOLERANCE_M


def fit_pivot(sweep: EyeSweep) -> PivotFit:
    """Return the pivot of a sweep's gazes, from targets at two depths; without these, the nominal one.

    A target at depth Z seen along a gaze from a pivot at (x, y, z) has the tangent tan a + (x - z tan a) / Z.
    The polynomial of the volts is projected out of both sides, which leaves three unknowns.
    """
    if not sweep.has_two_depths:
        return PivotFit()
    fit = fit_best_order(sweep.volts_v, sweep.angles_rad, orders=ORDERS)
    basis = fit.polynomial.basis(sweep.volts_v)
    tangents = np.tan(sweep.angles_rad)
    per_m = 1.0 / ((1.0 + tangents**2) * sweep.depth_m[:, None])
    columns, values = [], []
    for axis in (0, 1):
        effect = np.zeros((len(basis), 3))
        effect[:, axis] = per_m[:, axis]
        effect[:, 2] = -per_m[:, axis] * tangents[:, axis]
        root = np.sqrt(fit.weights[:, axis])[:, None]
        orthonormal = np.linalg.qr(basis * root)[0]
        side = root * np.column_stack([effect, sweep.angles_rad[:, axis]])
        side = side - orthonormal @ (orthonormal.T @ side)
        columns.append(side[:, :3])
        values.append(side[:, 3])
    matrix, target = np.vstack(columns), np.concatenate(values)
    offset = least_squares(matrix, target)
    free = len(target) - 2 * basis.shape[1] - 3
    variance = float(np.sum((target - matrix @ offset) ** 2)) / max(free, 1)
    covariance = variance * terms_covariance(matrix)
    x_m, y_m, z_m = offset.tolist()
    sigma_m = math.hypot(math.sqrt(max(covariance[0, 0], covariance[1, 1])), _drift_sigma_m(sweep))
    logger.info("gaze leaves %.2f, %.2f, %.2f mm beside the drawing", 1e3 * x_m, 1e3 * y_m, 1e3 * z_m)
    return PivotFit(offset_m=(x_m, y_m, z_m), sigma_m=sigma_m)


def _drift_sigma_m(sweep: EyeSweep) -> float:
    """Return the apparent shift of the pivot by drift that was not corrected.

    It follows from the uncertainty of a measured drift, else from the usual drift between the times of the
    near and the far targets.
    """
    if sweep.drift is not None:
        return sweep.drift.pivot_sigma_m
    if sweep.t_s is None:
        return 0.0
    inverse = 1.0 / sweep.depth_m
    near = inverse > math.sqrt(float(inverse.min() * inverse.max()))
    apart_s = abs(float(sweep.t_s[near].mean() - sweep.t_s[~near].mean()))
    return DRIFT_RAD_PER_S * apart_s / float(inverse[near].mean() - inverse[~near].mean())
