"""From the samples of a sweep to the calibration of a rig; polynomial orders are chosen by leave-one-out."""

import logging
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from foveacam_pipeline.calibrate.fit_homography import fit_homography
from foveacam_pipeline.calibrate.samples import EyeSweep, RigSweep
from foveacam_pipeline.geometry.polynomial import (
    BivariatePolynomial,
    PolynomialFit,
    exponents,
    fit_best_order,
    fit_polynomial,
    least_squares,
)
from foveacam_pipeline.models.calibration import Calibration, EyeCalibration
from foveacam_pipeline.models.homography import HomographyField
from foveacam_pipeline.models.mirror import MirrorModel

ORDERS = (1, 2, 3, 4, 5, 6, 7, 8, 9)
PIVOT_TOLERANCE_M = 0.4e-3
"""Assembly tolerance of the point from which a gaze leaves, assumed (deduced: tenths of a millimetre in the
mount and in the lens) where a sweep at one depth cannot measure it."""
_DOMAIN_MARGIN_RAD = math.radians(0.05)
_INVERSE_ORDER = 7
_PUPIL_STEPS_M = (10e-3, 1e-3)

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class PivotFit:
    """Where a gaze leaves, from the eye's reference point, m, and the standard error of its x and y."""

    offset_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    sigma_m: float = PIVOT_TOLERANCE_M


def fit_calibration(sweep: RigSweep) -> Calibration:
    """Fit both eyes; sweeps over two depths also measure baseline, pivots and pupil."""
    pivots = {"left": fit_pivot(sweep.left), "right": fit_pivot(sweep.right)}
    left_x, right_x = pivots["left"].offset_m[0], pivots["right"].offset_m[0]
    pupil_m = _fit_pupil(sweep)
    widened = (right_x - left_x) / 2.0
    return Calibration(
        rig_id=sweep.rig_id,
        created_utc=sweep.created_utc,
        origin=sweep.origin,
        label=sweep.label,
        wide=sweep.wide,
        left=_fit_eye(sweep, sweep.left, pivots["left"], pupil_m=pupil_m, reference_shift_m=-widened),
        right=_fit_eye(sweep, sweep.right, pivots["right"], pupil_m=pupil_m, reference_shift_m=widened),
        baseline_m=sweep.baseline_m + 2.0 * widened,
        fovea_f_px=sweep.fovea_f_px,
        fovea_width=sweep.fovea_width,
        fovea_height=sweep.fovea_height,
        pupil_m=pupil_m,
    )


def fit_mirror(
    volts_v: NDArray[np.float64], angles_rad: NDArray[np.float64], *, orders: tuple[int, ...] = ORDERS
) -> MirrorModel:
    """Fit a mirror to (n, 2) volts and the (n, 2) gaze angles, rad, measured under them."""
    fit = fit_best_order(volts_v, angles_rad, orders=orders)
    forward = fit.polynomial
    max_v = np.abs(volts_v).max(axis=0)
    sigma, loo = _model_sigma(fit, volts_v, angles_rad), fit.loo_rms
    logger.info(
        "mirror of order %d, left out %.4f and %.4f deg", forward.order, *(math.degrees(v) for v in loo)
    )
    return MirrorModel(
        forward=forward,
        inverse=_fit_inverse(forward, max_v),
        hull_rad=_hull(forward(volts_v)),
        margin_rad=_DOMAIN_MARGIN_RAD,
        max_v=(float(max_v[0]), float(max_v[1])),
        sigma_rad=(float(sigma[0]), float(sigma[1])),
        loo_rad=(float(loo[0]), float(loo[1])),
    )


def fit_pivot(sweep: EyeSweep) -> PivotFit:
    """Return where the gazes of a sweep leave, seen in how their directions change with the target's depth.

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
    covariance = variance * np.linalg.inv(matrix.T @ matrix)
    x_m, y_m, z_m = offset.tolist()
    sigma_m = math.sqrt(max(covariance[0, 0], covariance[1, 1]))
    logger.info("gaze leaves %.2f, %.2f, %.2f mm beside the drawing", 1e3 * x_m, 1e3 * y_m, 1e3 * z_m)
    return PivotFit(offset_m=(x_m, y_m, z_m), sigma_m=sigma_m)


def _fit_eye(
    sweep: RigSweep, eye: EyeSweep, pivot: PivotFit, *, pupil_m: float, reference_shift_m: float
) -> EyeCalibration:
    x_m, y_m, z_m = pivot.offset_m
    gaze = _gaze_from_pivot(eye, pivot)
    mirror = fit_mirror(eye.volts_v, gaze)
    field = _fit_field(sweep, eye, mirror.forward(eye.volts_v), pupil_m=pupil_m)
    logger.info("homographies of order %d, left out %.3f px", field.polynomial.order, field.loo_px)
    return EyeCalibration(
        mirror=mirror,
        homography=field,
        pivot_offset_m=(x_m - reference_shift_m, y_m, z_m),
        pivot_sigma_m=pivot.sigma_m,
        reference_depth_m=1.0 / float(np.mean(1.0 / eye.depth_m)),
    )


def _gaze_from_pivot(eye: EyeSweep, pivot: PivotFit) -> NDArray[np.float64]:
    """Return the (n, 2) gaze angles from the pivot itself; the sweep holds them from the reference point."""
    offset = np.array(pivot.offset_m)
    depth = eye.depth_m[:, None]
    gaze: NDArray[np.float64] = np.arctan((np.tan(eye.angles_rad) * depth - offset[:2]) / (depth - offset[2]))
    return gaze


def _fit_field(
    sweep: RigSweep,
    eye: EyeSweep,
    gaze: NDArray[np.float64],
    *,
    pupil_m: float,
    orders: tuple[int, ...] | None = None,
) -> HomographyField:
    forward = 1.0 / np.sqrt(1.0 + np.sum(np.tan(gaze) ** 2, axis=1))
    widening = 1.0 + pupil_m * forward / eye.depth_m
    keywords = {} if orders is None else {"orders": orders}
    return fit_homography(
        gaze,
        eye.raw_px,
        eye.plane_px / widening[:, None, None],
        width=sweep.fovea_width,
        height=sweep.fovea_height,
        **keywords,
    )


def _fit_pupil(sweep: RigSweep) -> float:
    """Return the pupil's distance behind the pivots for which near and far targets agree best, m."""
    if not (sweep.left.has_two_depths and sweep.right.has_two_depths):
        return sweep.pupil_m

    def disagreement(pupil_m: float) -> float:
        fields = [
            _fit_field(sweep, eye, eye.angles_rad, pupil_m=pupil_m, orders=(3,))
            for eye in (sweep.left, sweep.right)
        ]
        return fields[0].loo_px ** 2 + fields[1].loo_px ** 2

    pupil_m = sweep.pupil_m
    for step_m in _PUPIL_STEPS_M:  # squares of misfits: a parabola, the better the nearer
        below, at, above = (disagreement(pupil_m + side * step_m) for side in (-1.0, 0.0, 1.0))
        pupil_m += 0.5 * step_m * (below - above) / (below - 2.0 * at + above)
    logger.info("pupil %.2f mm behind the pivots", 1e3 * pupil_m)
    return pupil_m


def _model_sigma(
    fit: PolynomialFit, volts_v: NDArray[np.float64], angles_rad: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the (2,) standard error of a predicted angle: of the coefficients, and of what the order lacks.

    A fit two orders higher shows how much of the scatter is structure that the model leaves behind.
    """
    variance = fit.scatter**2
    parameters = len(exponents(fit.polynomial.order)) / len(volts_v)
    richer = fit.polynomial.order + 2
    lack = np.zeros_like(variance)
    if len(exponents(richer)) * 2 <= len(volts_v):
        lack = np.maximum(0.0, variance - fit_polynomial(volts_v, angles_rad, richer).scatter ** 2)
    sigma: NDArray[np.float64] = np.sqrt(variance * parameters + lack)
    return sigma


def _fit_inverse(forward: BivariatePolynomial, max_v: NDArray[np.float64]) -> BivariatePolynomial:
    """Return the polynomial from angles to volts that starts the Newton iteration of the mirror model."""
    line = np.linspace(-1.0, 1.0, 25)
    grid = np.array([(x, y) for x in line for y in line]) * max_v
    return fit_polynomial(forward(grid), grid, _INVERSE_ORDER, loss="square").polynomial


def _hull(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (m, 2) corners of the convex hull of (n, 2) directions, anticlockwise in (ax, ay)."""
    return np.asarray(angles[ConvexHull(angles).vertices], dtype=np.float64)
