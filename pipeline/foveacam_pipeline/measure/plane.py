"""Fit a plane to the depth of a region of a look, robustly, with the errors of matching and of the pose.

A plane is linear in disparity: d = a u + b v + c means a X' + b Y + (c / f) Z = B with X' = X + B/2. The fit
is therefore linear in the quantity whose errors are uniform, and a pose error changes only c.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.measure.look import LookDepth

FEWEST = 30
"""Least number of pixels of a plane; fewer do not determine its flatness."""
MOST = 20_000
"""Largest number of pixels used, spread evenly over the region."""
ROUNDS = 12
"""Iterations of the robust fit."""
TUKEY = 4.685
"""Residuals beyond this many robust standard deviations get no weight (95 % efficiency on normal errors)."""
OUTLIER = 4.0
CORRELATED_PX = 8.0
"""Correlation length of matching errors: the window and the smoothing of the matcher correlate them."""
LEAST_SIGMA_PX, LEAST_SCALE = 1e-4, 1e-3
"""Lower limits that prevent a division by zero on perfect data."""
STARTS, JUDGES = 300, 400
"""Number of planes through three samples tried, and of samples on which each is tested. With 45 % outliers a
sixth of the triples are clean, so that 300 draws miss them all with a probability below 1e-23."""
LEAST_AREA_PX2 = 25.0


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredPlane:
    """A fitted plane, rig frame.

    `normal`: unit vector towards the rig; `normal_sigma_rad`: rms angle between it and the true one.
    `pan_rad`: rotation to the right about the vertical, `tilt_rad`: rotation upwards.
    `distance_m`: of the rig's origin from the plane. `centre_rig_m`: of the pixels used. `residual_rms_m`,
    `flatness_m`: of the pixels that are no outliers, across the plane; flatness holds their middle 95 %.
    `expected_rms_m`: residual expected from matching errors alone.
    """

    normal: tuple[float, float, float]
    normal_sigma_rad: float
    pan_rad: float
    pan_sigma_rad: float
    tilt_rad: float
    tilt_sigma_rad: float
    distance_m: float
    distance_sigma_m: float
    centre_rig_m: tuple[float, float, float]
    residual_rms_m: float
    expected_rms_m: float
    flatness_m: float
    pixels: int
    outliers: int
    corners_rig_m: tuple[tuple[float, float, float], ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Samples:
    u_px: NDArray[np.float64]
    v_px: NDArray[np.float64]
    d_px: NDArray[np.float64]
    sigma_px: NDArray[np.float64]
    step_px: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Fit:
    """Coefficients (a, b, c), their covariance from matching, and the inliers."""

    abc: NDArray[np.float64]
    cov: NDArray[np.float64]
    inlier: NDArray[np.bool_]


def fit_plane(
    look: LookDepth, region: NDArray[np.bool_], *, outline_px: NDArray[np.float64]
) -> MeasuredPlane:
    """Fit the known pixels of `region`, (h, w) bool of the left window.

    `outline_px`: (n, 2) window pixels whose points on the plane become `corners_rig_m`.
    """
    samples = _samples(look, region)
    if len(samples.d_px) < FEWEST:
        raise InvalidInput(
            f"a plane needs {FEWEST} pixels with depth, the region has {len(samples.d_px)}",
            asked="a plane",
            found=f"{len(samples.d_px)} pixels with depth",
            remedy="drag a larger rectangle, or one on texture",
        )
    fit = _robust(samples)
    return _plane(look, samples, fit, outline_px)


def _samples(look: LookDepth, region: NDArray[np.bool_]) -> _Samples:
    known = region & np.isfinite(look.z_m) & np.isfinite(look.sigma_px)
    step = max(1, math.isqrt(max(0, int(np.count_nonzero(known)) - 1) // MOST) + 1)
    rows, columns = np.nonzero(known[::step, ::step])
    rows, columns = rows * step, columns * step
    return _Samples(
        u_px=columns.astype(np.float64) + look.u0_left_px,
        v_px=rows.astype(np.float64) + look.v0_px,
        d_px=look.f_px * look.baseline_m / look.z_m[rows, columns].astype(np.float64),
        sigma_px=np.maximum(look.sigma_px[rows, columns].astype(np.float64), LEAST_SIGMA_PX),
        step_px=float(step),
    )


def _robust(samples: _Samples) -> _Fit:
    """Fit by reweighted least squares (Tukey's biweight) from the best plane through three samples."""
    origin = np.array([samples.u_px.mean(), samples.v_px.mean()])
    design = np.column_stack([samples.u_px - origin[0], samples.v_px - origin[1], np.ones_like(samples.u_px)])
    weights = 1.0 / samples.sigma_px**2
    abc = _start(design, samples.d_px, samples.sigma_px)
    for _ in range(ROUNDS):
        normalised = (samples.d_px - design @ abc) / samples.sigma_px
        scale = max(1.4826 * float(np.median(np.abs(normalised))), LEAST_SCALE)
        share = np.clip(1.0 - (normalised / (TUKEY * scale)) ** 2, 0.0, None) ** 2
        abc = _weighted(design, samples.d_px, weights * share)
    normalised = (samples.d_px - design @ abc) / samples.sigma_px
    inlier = np.abs(normalised) <= OUTLIER * scale
    information = (design[inlier] * weights[inlier, None]).T @ design[inlier]
    alike = max(1.0, (CORRELATED_PX / samples.step_px) ** 2)  # correlated samples
    cov = np.linalg.inv(information) * max(1.0, scale**2) * alike
    shift = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-origin[0], -origin[1], 1.0]])
    return _Fit(
        abc=shift @ abc,
        cov=shift @ cov @ shift.T,
        inlier=inlier,
    )


def _start(
    design: NDArray[np.float64], d_px: NDArray[np.float64], sigma_px: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the coefficients with the least median residual among planes through three samples.

    Objects that fill less than half of the region do not influence it. Samples are drawn with a fixed seed.
    """
    rng = np.random.default_rng(len(d_px))
    judges = rng.choice(len(d_px), min(JUDGES, len(d_px)), replace=False)
    best = _weighted(design, d_px, 1.0 / sigma_px**2)
    least = float(np.median(np.abs(d_px[judges] - design[judges] @ best) / sigma_px[judges]))
    for three in rng.integers(0, len(d_px), (STARTS, 3)):
        corner = design[three]
        if abs(np.linalg.det(corner)) < LEAST_AREA_PX2:
            continue
        abc = np.linalg.solve(corner, d_px[three])
        middle = float(np.median(np.abs(d_px[judges] - design[judges] @ abc) / sigma_px[judges]))
        if middle < least:
            least, best = middle, abc
    return best


def _weighted(
    design: NDArray[np.float64], d_px: NDArray[np.float64], weights: NDArray[np.float64]
) -> NDArray[np.float64]:
    root = np.sqrt(weights)
    found, _, rank, _ = np.linalg.lstsq(design * root[:, None], d_px * root, rcond=None)
    if rank < 3:
        raise InvalidInput(
            "the pixels with depth lie on one line, which leaves the plane open",
            asked="a plane",
            found="pixels on one line",
            remedy="drag a wider rectangle",
        )
    return np.asarray(found, dtype=np.float64)


def _plane(look: LookDepth, samples: _Samples, fit: _Fit, outline_px: NDArray[np.float64]) -> MeasuredPlane:
    a, b, _ = fit.abc.tolist()
    left, right, both = look.pose_sigma_px
    pose_variance = ((1.0 - a) * left) ** 2 + right**2 + (b * both) ** 2
    cov = fit.cov + np.diag([0.0, 0.0, pose_variance])
    values = _derived(fit.abc, look)
    jacobian = _jacobian(fit.abc, cov, look)
    spread = np.sqrt(np.maximum(0.0, np.diag(jacobian @ cov @ jacobian.T)))
    across_m = _across_m(look, samples, fit, values)
    inlier = fit.inlier
    z_m = look.f_px * look.baseline_m / samples.d_px[inlier]
    rays = _rays(look, np.column_stack([samples.u_px, samples.v_px])[inlier])
    across_per_px = z_m * z_m / (look.f_px * look.baseline_m) * (rays @ values[:3])
    expected = np.sqrt(np.mean((across_per_px * samples.sigma_px[inlier]) ** 2))
    low, high = np.percentile(across_m[inlier], (2.5, 97.5))
    return MeasuredPlane(
        normal=_triple(values[:3]),
        normal_sigma_rad=float(np.linalg.norm(spread[:3])),
        pan_rad=float(values[3]),
        pan_sigma_rad=float(spread[3]),
        tilt_rad=float(values[4]),
        tilt_sigma_rad=float(spread[4]),
        distance_m=float(values[5]),
        distance_sigma_m=float(spread[5]),
        centre_rig_m=_triple((rays * z_m[:, None]).mean(axis=0) - _half(look)),
        residual_rms_m=float(np.sqrt(np.mean(across_m[inlier] ** 2))),
        expected_rms_m=float(expected),
        flatness_m=float(high - low),
        pixels=len(samples.d_px),
        outliers=int(np.count_nonzero(~inlier)),
        corners_rig_m=_corners(look, fit.abc, outline_px),
    )


def _derived(abc: NDArray[np.float64], look: LookDepth) -> NDArray[np.float64]:
    """Return normal (3), pan, tilt, rad, and distance from the origin, m, of plane coefficients."""
    towards = np.array([abc[0], abc[1], abc[2] / look.f_px])
    size = float(np.linalg.norm(towards))
    normal = -towards / size
    pan, tilt = math.atan2(normal[0], -normal[2]), math.asin(float(np.clip(-normal[1], -1.0, 1.0)))
    distance_m = look.baseline_m / size + float(normal[0]) * look.baseline_m / 2.0
    return np.array([*normal, pan, tilt, distance_m])


def _jacobian(abc: NDArray[np.float64], cov: NDArray[np.float64], look: LookDepth) -> NDArray[np.float64]:
    """Return (6, 3) derivatives of `_derived`, by central differences of a hundredth of a standard error."""
    steps = np.maximum(0.01 * np.sqrt(np.diag(cov)), 1e-9)
    columns = []
    for axis, step in enumerate(steps.tolist()):
        move = np.zeros(3)
        move[axis] = step
        columns.append((_derived(abc + move, look) - _derived(abc - move, look)) / (2.0 * step))
    return np.column_stack(columns)


def _across_m(
    look: LookDepth, samples: _Samples, fit: _Fit, values: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return each sample's signed distance from the plane, m; positive towards the rig."""
    rays = _rays(look, np.column_stack([samples.u_px, samples.v_px]))
    z_m = look.f_px * look.baseline_m / samples.d_px
    points = rays * z_m[:, None] - _half(look)
    return np.asarray(points @ values[:3] + values[5], dtype=np.float64)


def _rays(look: LookDepth, plane_px: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.column_stack([plane_px / look.f_px, np.ones(len(plane_px))])


def _half(look: LookDepth) -> NDArray[np.float64]:
    return np.array([look.baseline_m / 2.0, 0.0, 0.0])


def _corners(
    look: LookDepth, abc: NDArray[np.float64], outline_px: NDArray[np.float64]
) -> tuple[tuple[float, float, float], ...]:
    """Return where the rays of the outline meet the plane; empty when one does not."""
    plane_px = outline_px + np.array([look.u0_left_px, look.v0_px])
    d_px = plane_px @ abc[:2] + abc[2]
    if (d_px <= 0.0).any():
        return ()
    z_m = look.f_px * look.baseline_m / d_px
    points = _rays(look, plane_px) * z_m[:, None] - _half(look)
    return tuple(_triple(point) for point in points)


def _triple(values: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z
