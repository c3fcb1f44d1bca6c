"""Fit of a homography field to the corners of a sweep (Eq. 4), all at once or pose by pose.

All at once is one robust linear least-squares problem over every pose and corner, with leave-one-pose-out
errors from blocks of the hat matrix. Pose by pose is the paper's method; its perspective entries are noisy.
"""

import logging
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.geometry.polynomial import (
    OUTLIER_WEIGHT,
    BivariatePolynomial,
    exponents,
    fit_polynomial,
    huber_weights,
    least_squares,
    monomials,
    scaling_of,
)
from foveacam_pipeline.models.homography import ENTRIES, HomographyField

ORDERS = (1, 2, 3, 4, 5)
_ROUNDS = 6
_LOO_TOLERANCE = 0.02

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class FieldScore:
    """One rectification of one eye: how it was fitted, and its leave-one-pose-out distance, fovea px."""

    name: str
    order: int
    terms: int
    loo_px: float
    chosen: bool = False


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FieldFit:
    """The chosen field and the scores of all orders that were tried."""

    field: HomographyField
    scores: tuple[FieldScore, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Corners:
    """Corners about the image centre, each (n, m), in units of `scale_px`; `seen` is 0 for a missing one."""

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    u: NDArray[np.float64]
    v: NDArray[np.float64]
    seen: NDArray[np.float64]


def fit_fields(
    angles_rad: NDArray[np.float64],
    raw_px: NDArray[np.float64],
    plane_px: NDArray[np.float64],
    *,
    width: int,
    height: int,
    orders: tuple[int, ...] = ORDERS,
    pose_by_pose: bool = False,
) -> FieldFit:
    """Fit the fields of all orders; choose the lowest whose leave-one-pose-out error is about the best.

    `angles_rad`: (n, 2) gazes. `raw_px`, `plane_px`: (n, m, 2), corners in the image (NaN: not seen) and on
    the virtual pinhole plane relative to the gaze. `width`, `height`: of the fovea image, px.
    """
    centre = ((width - 1) / 2.0, (height - 1) / 2.0)
    scale = width / 2.0
    corners = _scaled(raw_px, plane_px, centre=np.array(centre), scale=scale)
    feasible = [order for order in sorted(orders) if _enough(order, corners)]
    if not feasible:
        raise InvalidInput(
            f"homographies of order {min(orders)} need at least {2 * len(exponents(min(orders)))} poses "
            f"with four corners each, {len(angles_rad)} poses were given; add poses"
        )
    fit = _fit_entries if pose_by_pose else _fit_order
    fits = [fit(angles_rad, corners, order) for order in feasible]
    limit = min(loo for _, loo in fits) * (1.0 + _LOO_TOLERANCE)
    best = next(k for k, (_, loo) in enumerate(fits) if loo <= limit)
    polynomial, loo = fits[best]
    logger.debug("homographies of order %d, left out %.3f px", polynomial.order, loo * scale)
    scores = tuple(
        FieldScore(
            name=f"order {order}, {'pose by pose' if pose_by_pose else 'all at once'}",
            order=order,
            terms=len(exponents(order)),
            loo_px=error * scale,
            chosen=k == best,
        )
        for k, (order, (_, error)) in enumerate(zip(feasible, fits, strict=True))
    )
    field = HomographyField(polynomial=polynomial, centre_px=centre, scale_px=scale, loo_px=loo * scale)
    return FieldFit(field=field, scores=scores)


def apply_field(
    field: HomographyField, angles_rad: NDArray[np.float64], raw_px: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return (n, m, 2) plane px about the gazes (n, 2) of raw fovea px (n, m, 2), a set a pose."""
    a, b, c, d, e, f = field.polynomial(angles_rad).T[:, :, None]
    x, y = np.moveaxis((raw_px - np.array(field.centre_px)) / field.scale_px, -1, 0)
    places = np.stack([a * x + b * y, c * x + d * y], axis=-1)
    return np.asarray(field.scale_px * places / (1.0 + e * x + f * y)[..., None], dtype=np.float64)


def _scaled(
    raw_px: NDArray[np.float64], plane_px: NDArray[np.float64], *, centre: NDArray[np.float64], scale: float
) -> "_Corners":
    seen: NDArray[np.bool_] = np.asarray(np.isfinite(raw_px + plane_px).all(axis=2))
    raw = np.where(seen[:, :, None], (raw_px - centre) / scale, 0.0)
    plane = np.where(seen[:, :, None], plane_px / scale, 0.0)
    return _Corners(
        x=raw[..., 0], y=raw[..., 1], u=plane[..., 0], v=plane[..., 1], seen=seen.astype(np.float64)
    )


def _enough(order: int, corners: _Corners) -> bool:
    poses = int((corners.seen.sum(axis=1) >= 4).sum())
    return poses >= 2 * len(exponents(order))


def _rows(basis: NDArray[np.float64], corners: _Corners) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the linear equations of every corner: (n, m, 2, 6 k) and right-hand sides (n, m, 2).

    From u (1 + e x + f y) = a x + b y, and so for v; unknowns ordered entry by entry.
    """
    x, y, u, v = corners.x, corners.y, corners.u, corners.v
    zero = np.zeros_like(x)
    factors = np.stack(
        [
            np.stack([x, y, zero, zero, -u * x, -u * y], axis=-1),
            np.stack([zero, zero, x, y, -v * x, -v * y], axis=-1),
        ],
        axis=2,
    )
    matrix = factors[..., :, None] * basis[:, None, None, None, :]
    return matrix.reshape(*factors.shape[:3], ENTRIES * basis.shape[1]), np.stack([u, v], axis=2)


def _fit_order(
    angles: NDArray[np.float64], corners: _Corners, order: int
) -> tuple[BivariatePolynomial, float]:
    """Return the field of one order and its leave-one-pose-out error in units of the corners.

    The linear rounds stay by hand: scipy's least squares took 8 to 11 times as long on the sweeps of the
    tests (order 3, 144 poses: 120 ms for 11 ms), and the entries agreed within 7e-4.
    """
    centre, scale = scaling_of(angles)
    basis = monomials((angles[:, 0] - centre[0]) / scale[0], (angles[:, 1] - centre[1]) / scale[1], order)
    equations, values = _rows(basis, corners)
    unknowns = equations.shape[-1]
    perspective = np.ones_like(corners.x)
    weights = corners.seen
    for _ in range(_ROUNDS):
        root = np.sqrt(weights)[:, :, None]
        matrix = equations * (root / perspective[:, :, None])[..., None]
        target = values * root / perspective[:, :, None]
        flat = matrix.reshape(-1, unknowns)
        gram = flat.T @ flat
        solution: NDArray[np.float64] = np.asarray(np.linalg.solve(gram, flat.T @ target.ravel()), np.float64)
        entries = basis @ solution.reshape(ENTRIES, -1).T
        perspective = 1.0 + entries[:, 4:5] * corners.x + entries[:, 5:6] * corners.y
        misses = np.linalg.norm(values - equations @ solution, axis=2) / perspective
        weights = corners.seen.copy()
        weights[corners.seen > 0.0] = huber_weights(misses[corners.seen > 0.0])
    inverse_gram: NDArray[np.float64] = np.asarray(np.linalg.inv(gram), np.float64)
    left_out = _leave_pose_out(matrix, target - matrix @ solution, inverse_gram).reshape(target.shape)
    inliers = root[..., 0] > math.sqrt(OUTLIER_WEIGHT)
    squares = np.sum((left_out / np.maximum(root, 1e-9)) ** 2, axis=2)
    coefficients = solution.reshape(ENTRIES, -1).T.copy()
    polynomial = BivariatePolynomial(order=order, centre=centre, scale=scale, coefficients=coefficients)
    return polynomial, float(np.sqrt(np.mean(squares[inliers])))


def _leave_pose_out(
    matrix: NDArray[np.float64], residuals: NDArray[np.float64], inverse_gram: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return (n, 2 m) weighted residuals of each pose under the fit without it: (I - H_jj)^-1 r_j."""
    poses = matrix.shape[0]
    blocks = matrix.reshape(poses, -1, matrix.shape[-1])
    hat = blocks @ inverse_gram @ blocks.transpose(0, 2, 1)
    left_out = np.linalg.solve(np.eye(blocks.shape[1]) - hat, residuals.reshape(poses, -1, 1))
    return np.asarray(left_out[..., 0], dtype=np.float64)


def _fit_entries(
    angles: NDArray[np.float64], corners: _Corners, order: int
) -> tuple[BivariatePolynomial, float]:
    """Return the field through one homography for each pose, and its leave-one-pose-out error.

    The image centre is the gaze, so that each pose has six entries of its own.
    """
    several = corners.seen.sum(axis=1) >= 4
    entries = np.array([_entries_of(corners, pose) for pose in np.flatnonzero(several).tolist()])
    fit = fit_polynomial(angles[several], entries, order)
    guessed = entries - fit.loo_residuals
    x, y, u, v, seen = (part[several] for part in (corners.x, corners.y, corners.u, corners.v, corners.seen))
    a, b, c, d, e, f = guessed.T[:, :, None]
    below = 1.0 + e * x + f * y
    misses = np.hypot((a * x + b * y) / below - u, (c * x + d * y) / below - v)
    inliers = (seen > 0.0) & (huber_weights(misses) > OUTLIER_WEIGHT)
    return fit.polynomial, float(np.sqrt(np.mean(misses[inliers] ** 2)))


def _entries_of(corners: _Corners, pose: int) -> NDArray[np.float64]:
    """Return the (6,) entries of the homography that fits the corners of one pose best."""
    seen = corners.seen[pose] > 0.0
    x, y, u, v = (part[pose][seen] for part in (corners.x, corners.y, corners.u, corners.v))
    zero = np.zeros_like(x)
    across = np.stack([x, y, zero, zero, -u * x, -u * y], axis=1)
    down = np.stack([zero, zero, x, y, -v * x, -v * y], axis=1)
    return least_squares(np.concatenate([across, down]), np.concatenate([u, v]))
