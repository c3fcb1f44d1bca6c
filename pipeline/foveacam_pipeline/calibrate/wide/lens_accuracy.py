"""Accuracy of a fitted lens in the conversion of pixels to angles and back."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.calibrate.wide.wide_bundle import FOCAL_AND_CENTRE, POSE, LensBundle, solve_scaled
from foveacam_pipeline.geometry.angles import tan_from_angles
from foveacam_pipeline.models.intrinsics import Intrinsics

GRID = (25, 19)
USEFUL_PX = 5.0
"""Standard error beyond which a direction is of no use: a tenth of a degree of the wide camera."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LensAccuracy:
    """Error of the conversion from pixel to angle, in px of the image.

    `sigma_px`: standard error, rms over the part of the image that the lens has directions for.
    `known_fraction`: that part. `map_px`: (19, 25) standard error wherever the model has a direction, NaN
    elsewhere.
    `covariance`: of the lens's parameters.
    """

    sigma_px: float
    sigma_rad: float
    map_px: NDArray[np.float64]
    known_fraction: float
    covariance: NDArray[np.float64]


def accuracy_of(bundle: LensBundle, lens: Intrinsics) -> LensAccuracy:
    """Return the accuracy by the noise, or by the jackknife over views, whichever is worse."""
    pixels = grid_px(lens.width, lens.height)
    tangents = tan_from_angles(lens.angles_rad(pixels))
    known = np.isfinite(tangents).all(axis=1)
    slopes = _slopes(lens, tangents[known])
    best: LensAccuracy | None = None
    for covariance in (_by_noise(bundle), _by_leaving_out(bundle)):
        variances = np.einsum("nij,jk,nik->n", slopes, covariance, slopes)
        sigma_px = float(np.sqrt(max(float(variances.mean()), 0.0)))
        if best is None or sigma_px > best.sigma_px:
            map_px = np.full(len(pixels), np.nan)
            map_px[known] = np.sqrt(np.maximum(variances, 0.0))
            best = LensAccuracy(
                sigma_px=sigma_px,
                sigma_rad=sigma_px / float(np.sqrt(lens.fx_px * lens.fy_px)),
                map_px=map_px.reshape(GRID[1], GRID[0]),
                known_fraction=float(known.mean()),
                covariance=covariance,
            )
    assert best is not None  # noqa: S101 - the loop above runs twice
    return best


def kept_to_useful(lens: Intrinsics, accuracy: LensAccuracy) -> tuple[Intrinsics, LensAccuracy]:
    """Return a lens without the directions beyond which some are no more accurate than `USEFUL_PX`.

    Where no view shows the corners of an image, a polynomial says there whatever it likes.
    """
    pixels, sigma_px = grid_px(lens.width, lens.height), accuracy.map_px.ravel()
    radius = np.hypot(*tan_from_angles(lens.angles_rad(pixels)).T)
    useless = sigma_px > USEFUL_PX
    if not useless.any():
        return lens, accuracy
    known = radius < float(radius[useless].min())
    rms_px = float(np.sqrt(np.mean(sigma_px[known] ** 2))) if known.any() else accuracy.sigma_px
    kept = replace(
        accuracy,
        sigma_px=rms_px,
        sigma_rad=rms_px / float(np.sqrt(lens.fx_px * lens.fy_px)),
        known_fraction=float(known.mean()),
    )
    return replace(lens, known_tan=float(radius[known].max(initial=0.0))), kept


def parameter_sigmas(bundle: LensBundle) -> NDArray[np.float64]:
    """Return the (p,) standard errors of the lens's parameters, each by the worse of both ways."""
    both = [np.diag(covariance) for covariance in (_by_noise(bundle), _by_leaving_out(bundle))]
    return np.asarray(np.sqrt(np.maximum(*both)))


def noise_sigmas(bundle: LensBundle) -> NDArray[np.float64]:
    """Return the (p,) standard errors of the lens's parameters by the noise alone, proportional to it."""
    return np.asarray(np.sqrt(np.diag(_by_noise(bundle))))


def grid_px(width: int, height: int) -> NDArray[np.float64]:
    """Return (475, 2) pixels on a grid over an image, row by row."""
    x, y = np.meshgrid(np.linspace(-0.5, width - 0.5, GRID[0]), np.linspace(-0.5, height - 0.5, GRID[1]))
    return np.column_stack([x.ravel(), y.ravel()])


def _by_noise(bundle: LensBundle) -> NDArray[np.float64]:
    normal = bundle.normals.sum(axis=0) + bundle.prior.normal
    return solve_scaled(normal, np.eye(len(normal)))


def _by_leaving_out(bundle: LensBundle) -> NDArray[np.float64]:
    """Return the covariance by the jackknife over views, which includes errors shared by a view's corners."""
    views = len(bundle.normals)
    normal = bundle.normals.sum(axis=0) + bundle.prior.normal
    moved = np.array(
        [-solve_scaled(normal - own, right) for own, right in zip(bundle.normals, bundle.rights, strict=True)]
    )
    centred = moved - moved.mean(axis=0)
    return np.asarray((views - 1.0) / views * centred.T @ centred)


def _slopes(lens: Intrinsics, tangents: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n, 2, p) derivatives of the pixels of fixed directions, tangents (n, 2), by the lens."""
    points = np.column_stack([tangents, np.ones(len(tangents))])
    zero = np.zeros(3)
    _, slopes = cv2.projectPoints(points, zero, zero, lens.matrix, np.array(lens.distortion))
    rows = np.asarray(slopes, dtype=np.float64).reshape(len(points), 2, -1)
    count = FOCAL_AND_CENTRE + len(lens.distortion)
    return rows[:, :, POSE : POSE + count]
