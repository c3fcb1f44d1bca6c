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


def _equations(corners: _Corners) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the linear equations of every corner in a pose's six entries, (n, 2 m, 6) and values (n, 2 m).

    They follow from u (1 + e x + f y) = a x + b y, likewise for v.
    """
    x, y, u, v = corners.x, corners.y, corners.u, corners.v
    zero = np.zeros_like(x)
    across = np.stack([x, y, zero, zero, -u * x, -u * y], axis=-1)
    down = np.stack([zero, zero, x, y, -v * x, -v * y], axis=-1)
    return np.concatenate([across, down], axis=1), np.concatenate([u, v], axis=1)


def _fit_order(
    angles: NDArray[np.float64], corners: _Corners, order: int
) -> tuple[BivariatePolynomial, float]:
    """Return the field of one order and its leave-one-pose-out error in units of the corners.

    An unknown is a pose's entry times a monomial of its gaze: six equations per pose contain all information
    of its corners. The linear rounds stay by hand: scipy's least squares took many times as long on the
    sweeps of the tests, and the entries agreed within 7e-4.
    """
    centre, scale = scaling_of(angles)
    basis = monomials((angles[:, 0] - centre[0]) / scale[0], (angles[:, 1] - centre[1]) / scale[1], order)
    products = np.asarray(basis[:, :, None] * basis[:, None, :], dtype=np.float64)
    equations, values = _equations(corners)
    perspective = np.ones_like(corners.x)
    weights = corners.seen
    for _ in range(_ROUNDS):
        root = np.sqrt(weights)
        factors = np.tile(root / perspective, 2)
        weighted, target = equations * factors[..., None], values * factors
        moments = weighted.transpose(0, 2, 1) @ weighted
        gram = _over_terms(moments, products)
        aims = (weighted.transpose(0, 2, 1) @ target[..., None])[..., 0]
        solution = np.linalg.solve(gram, (aims.T @ basis).ravel()).reshape(ENTRIES, -1)
        entries = basis @ solution.T
        perspective = 1.0 + entries[:, 4:5] * corners.x + entries[:, 5:6] * corners.y
        missed = values - (equations @ entries[..., None])[..., 0]
        misses = np.hypot(*np.split(missed, 2, axis=1)) / perspective
        weights = corners.seen.copy()
        weights[corners.seen > 0.0] = huber_weights(misses[corners.seen > 0.0])
    reach = _of_poses(np.asarray(np.linalg.inv(gram), dtype=np.float64), products)
    left_out = _leave_pose_out(weighted, missed * factors, reach, moments)
    inliers = root > math.sqrt(OUTLIER_WEIGHT)
    squares = np.sum(np.square(np.split(left_out, 2, axis=1)), axis=0) / np.maximum(root, 1e-9) ** 2
    coefficients = np.array(solution.T, dtype=np.float64)
    polynomial = BivariatePolynomial(order=order, centre=centre, scale=scale, coefficients=coefficients)
    return polynomial, float(np.sqrt(np.mean(squares[inliers])))


def _over_terms(moments: NDArray[np.float64], products: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the equations (6 k, 6 k) of all unknowns, entry by entry, from those of each pose (n, 6, 6)."""
    terms = products.shape[1]
    gram = moments.reshape(len(moments), -1).T @ products.reshape(len(products), -1)
    whole = gram.reshape(ENTRIES, ENTRIES, terms, terms).transpose(0, 2, 1, 3)
    return np.asarray(whole.reshape(ENTRIES * terms, ENTRIES * terms), dtype=np.float64)


def _of_poses(inverse_gram: NDArray[np.float64], products: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the covariance (n, 6, 6) of the entries of each pose from that of all unknowns."""
    terms = products.shape[1]
    parts = inverse_gram.reshape(ENTRIES, terms, ENTRIES, terms).transpose(1, 3, 0, 2)
    found = products.reshape(len(products), -1) @ parts.reshape(terms * terms, -1)
    return np.asarray(found.reshape(-1, ENTRIES, ENTRIES), dtype=np.float64)


def _leave_pose_out(
    weighted: NDArray[np.float64],
    residuals: NDArray[np.float64],
    reach: NDArray[np.float64],
    moments: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return (n, 2 m) weighted residuals of each pose under the fit without it: (I - A Q A^T)^-1 r.

    With A = `weighted` (n, 2 m, 6), Q = `reach` and A^T A = `moments` that is
    r + A (I - Q A^T A)^-1 Q A^T r.
    """
    pulled = reach @ (weighted.transpose(0, 2, 1) @ residuals[..., None])
    change = weighted @ np.linalg.solve(np.eye(ENTRIES) - reach @ moments, pulled)
    return np.asarray(residuals + change[..., 0], dtype=np.float64)


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
