"""Least squares over all rays: the samples' points, and the errors of stops and gazes within their priors.

Every sample's point is eliminated, so that the system does not grow with the number of samples. Rays that
contradict the rest get less weight at first and are rejected later; the remaining disagreement beyond the
stated errors widens all errors.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import bsr_array, csr_array, eye_array

from foveacam_pipeline.capture.reference.rail_model import RailModel
from foveacam_pipeline.capture.reference.rays import LinearizedRays, Rays, linearize
from foveacam_pipeline.capture.reference.values import Floats

ROUNDS = 4
DROPS = 3
HUBER = 2.0
OUTLIER = 4.0
"""Residual over its error above which a ray counts as a wrong match."""
INCONSISTENT = 4.0
"""Mean square of a sample's residuals over their errors above which its rays do not see one object."""
LEAST_RAYS = 3
LEAST_LONGER = 1.2
"""Minimum baseline between two rays of a sample, over the rig's own baseline."""
CHUNK = 256


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AdjustedRays:
    """Consistent rays and their samples' points (m, 3), NaN where there is none; errors are standard errors.

    `sigma_m`: (m,) total error of z; `own_sigma_m`: (m,), the part that other samples do not share.
    `unknowns`, `unknowns_covariance`: of the model. `noise_factor`: factor by which errors were widened.
    `residual_px`: (n, 2) of the remaining rays; `outliers`: number of rejected rays.
    """

    rays: Rays
    points_m: Floats
    sigma_m: Floats
    own_sigma_m: Floats
    unknowns: Floats
    unknowns_covariance: Floats
    noise_factor: float
    residual_px: Floats
    outliers: int


def adjust_rays(rays: Rays, points_m: Floats, model: RailModel, *, baseline_m: float) -> AdjustedRays:
    """Return the adjusted points of samples; `points_m`: (m, 3) start values, `baseline_m`: of the rig."""
    unknowns = np.zeros(len(model.sigmas))
    rays = rays.select(_usable(rays, model, unknowns, least_m=LEAST_LONGER * baseline_m))
    first = len(rays)
    points = points_m.copy()
    factor = 1.0
    for drop in range(DROPS + 2):
        for _ in range(ROUNDS):
            step, move = _step(rays, points, model, unknowns, factor=factor, robust=drop == 0)
            unknowns, points = unknowns + step, points + move
        size = _normalized_residuals(rays, linearize(rays, points, model, unknowns))
        factor = _noise(rays, size)
        bad = _outlying(rays, size / factor, every=drop >= DROPS)
        if not bad.any() or drop > DROPS:
            break
        kept = rays.select(~bad)
        rays = kept.select(_usable(kept, model, unknowns, least_m=LEAST_LONGER * baseline_m))
    return _result(rays, points, model, unknowns, factor=factor, outliers=first - len(rays))


def _outlying(rays: Rays, size: Floats, *, every: bool) -> NDArray[np.bool_]:
    """Return the rays to reject: the worst of every sample, or `every` outlier; then inconsistent samples.

    Only the worst at first, because a wrong ray distorts the others, which may agree without it.
    """
    worst = np.zeros(int(rays.sample.max(initial=-1)) + 1)
    np.maximum.at(worst, rays.sample, size)
    bad = (size > OUTLIER) & (every | (size == worst[rays.sample]))
    torn = (_mean_squares(rays, size) > INCONSISTENT)[rays.sample]
    return np.asarray(bad | torn if every or not bad.any() else bad, dtype=np.bool_)


def _usable(rays: Rays, model: RailModel, unknowns: Floats, *, least_m: float) -> NDArray[np.bool_]:
    """Return which rays belong to samples with enough rays, and a long enough baseline."""
    count = np.bincount(rays.sample, minlength=1)
    spread = longest_baselines_m(rays, model, unknowns)
    good = (count >= LEAST_RAYS) & (spread > least_m)
    return np.asarray(good[rays.sample], dtype=np.bool_)


def longest_baselines_m(rays: Rays, model: RailModel, unknowns: Floats) -> Floats:
    """Return (m,) the longest baseline of every sample's rays, along x, the direction of the rail."""
    x = rays.centres_m(model, unknowns)[:, 0]
    count = int(rays.sample.max(initial=-1)) + 1
    high, low = np.full(count, -np.inf), np.full(count, np.inf)
    np.maximum.at(high, rays.sample, x)
    np.minimum.at(low, rays.sample, x)
    return np.where(np.isfinite(high - low), high - low, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Normal:
    """Normal equations: of the unknowns (k, k) sparse, mixed (k, 3 m) sparse, of the points (m, 3, 3).

    `right`: (k,), `right_points`: (m, 3).
    """

    unknowns: csr_array
    mixed: csr_array
    points: Floats
    right: Floats
    right_points: Floats

    def through(self) -> csr_array:
        """Return (k, 3 m) sparse: mixed times the inverse of the points' part."""
        inverse = np.linalg.inv(self.points)
        count = len(inverse)
        blocks = bsr_array((inverse, np.arange(count), np.arange(count + 1)), shape=(3 * count, 3 * count))
        return csr_array(self.mixed @ blocks)

    def reduced(self) -> tuple[Floats, Floats]:
        """Return (k, k) and (k,): the equations of the unknowns after elimination of the points."""
        through = self.through()
        matrix = (self.unknowns - through @ self.mixed.T).toarray()
        return np.asarray(matrix), np.asarray(self.right - through @ self.right_points.ravel())


def _normal(rays: Rays, found: LinearizedRays, weight: Floats, model: RailModel, *, samples: int) -> _Normal:
    scale = np.sqrt(weight)[:, None, None]
    a = scale * (rays.whiten @ found.by_unknowns)
    b = scale * (rays.whiten @ found.by_point)
    r = scale[:, :, 0] * np.einsum("nij,nj->ni", rays.whiten, found.residual_px)
    points, right_points = np.zeros((samples, 3, 3)), np.zeros((samples, 3))
    np.add.at(points, rays.sample, b.transpose(0, 2, 1) @ b)
    np.add.at(right_points, rays.sample, -np.einsum("nij,ni->nj", b, r))
    points[np.bincount(rays.sample, minlength=samples) == 0] = np.eye(3)
    rows = np.arange(2 * len(rays))
    count = len(model.sigmas)
    by_unknowns = _sparse(a, rows, np.repeat(found.columns, 2, axis=0), (len(rows), count))
    places = 3 * np.repeat(rays.sample, 2)[:, None] + np.arange(3)
    by_point = _sparse(b, rows, places, (len(rows), 3 * samples))
    return _Normal(
        unknowns=csr_array(by_unknowns.T @ by_unknowns + eye_array(count)),
        mixed=csr_array(by_unknowns.T @ by_point),
        points=points,
        right=np.asarray(-(by_unknowns.T @ r.ravel())),
        right_points=right_points,
    )


def _sparse(
    values: Floats, rows: NDArray[np.intp], columns: NDArray[np.intp], shape: tuple[int, int]
) -> csr_array:
    flat = values.reshape(len(rows), columns.shape[1])
    return csr_array((flat.ravel(), (np.repeat(rows, flat.shape[1]), columns.ravel())), shape=shape)


def _step(
    rays: Rays, points_m: Floats, model: RailModel, unknowns: Floats, *, factor: float, robust: bool
) -> tuple[Floats, Floats]:
    """Return one Gauss-Newton step: of the unknowns (k,) and of the points (m, 3)."""
    found = linearize(rays, points_m, model, unknowns)
    weight = np.full(len(rays), factor**-2.0)
    if robust:
        weight *= np.minimum(1.0, HUBER / np.maximum(_normalized_residuals(rays, found), 1e-9))
    normal = _normal(rays, found, weight, model, samples=len(points_m))
    matrix, right = normal.reduced()
    step = np.asarray(np.linalg.solve(matrix, right - unknowns), dtype=np.float64)
    rest = normal.right_points - (normal.mixed.T @ step).reshape(-1, 3)
    return step, np.linalg.solve(normal.points, rest[:, :, None])[:, :, 0]


def _normalized_residuals(rays: Rays, found: LinearizedRays) -> Floats:
    """Return (n,) residuals over their errors, rms of both axes."""
    whitened = np.einsum("nij,nj->ni", rays.whiten, found.residual_px)
    return np.asarray(np.linalg.norm(whitened, axis=1) / np.sqrt(2.0), dtype=np.float64)


def _mean_squares(rays: Rays, sizes: Floats) -> Floats:
    """Return (m,) the mean square of every sample's residuals over their errors, per degree of freedom."""
    free = 2.0 * np.bincount(rays.sample) - 3.0
    return np.asarray(np.bincount(rays.sample, 2.0 * sizes**2) / np.maximum(free, 1.0), dtype=np.float64)


def _noise(rays: Rays, size: Floats) -> float:
    """Return how much rays disagree beyond their stated errors, 1 or more: the median sample's factor."""
    square = _mean_squares(rays, size)
    free = 2.0 * np.bincount(rays.sample) - 3.0
    known = free > 0.0
    if not known.any():
        return 1.0
    median = (1.0 - 2.0 / (9.0 * free[known])) ** 3
    return max(1.0, float(np.sqrt(np.median(square[known] / median))))


def _result(
    rays: Rays,
    points_m: Floats,
    model: RailModel,
    unknowns: Floats,
    *,
    factor: float,
    outliers: int,
) -> AdjustedRays:
    found = linearize(rays, points_m, model, unknowns)
    normal = _normal(rays, found, np.full(len(rays), factor**-2.0), model, samples=len(points_m))
    covariance = np.asarray(np.linalg.inv(normal.reduced()[0]), dtype=np.float64)
    own = np.linalg.inv(normal.points)[:, 2, 2]
    shared = _along_z(normal.through(), covariance)
    lacking = np.bincount(rays.sample, minlength=len(points_m)) == 0
    points = np.where(lacking[:, None], np.nan, points_m)
    return AdjustedRays(
        rays=rays,
        points_m=points,
        sigma_m=np.sqrt(own + shared),
        own_sigma_m=np.sqrt(own),
        unknowns=unknowns,
        unknowns_covariance=covariance,
        noise_factor=factor,
        residual_px=found.residual_px,
        outliers=outliers,
    )


def _along_z(through: csr_array, covariance: Floats) -> Floats:
    """Return (m,) the variance of the points' z from errors of the unknowns, m², in chunks of samples."""
    every = csr_array(through[:, 2::3].T)
    parts = [every[first : first + CHUNK] for first in range(0, every.shape[0], CHUNK)]
    return np.concatenate([np.asarray((part.multiply(part @ covariance)).sum(axis=1)) for part in parts])
