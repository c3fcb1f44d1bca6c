"""Triangulate points of the rig frame from total disparity or from two rays, with standard errors.

The eyes' reference points lie at (-B/2, 0, 0) and (+B/2, 0, 0) m, left then right. Total disparity is
d = (uL + u0L) - (uR + u0R) on the virtual pinhole planes; Z = f B / d holds off the axis as on it, and
its standard error is Z² / (B f) times that of d (Sec. 4.1). d <= 0 is at or beyond infinity: Z = inf.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.geometry.shapes import as_rows


def depth_from_disparity_m(disparity_px: ArrayLike, *, f_px: float, baseline_m: float) -> NDArray[np.float64]:
    """Return Z, m, of total disparity: any shape; inf where d <= 0, NaN where d is NaN."""
    d = np.asarray(disparity_px, dtype=np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        z = np.where(d > 0.0, f_px * baseline_m / d, np.inf)
    return np.where(np.isnan(d), np.nan, z)


def depth_sigma_m(
    depth_m: ArrayLike, disparity_sigma_px: ArrayLike, *, f_px: float, baseline_m: float
) -> NDArray[np.float64]:
    """Return the standard error of Z, m: Z² / (B f) times the error of d, px."""
    z = np.asarray(depth_m, dtype=np.float64)
    sigma: NDArray[np.float64] = (
        z * z / (baseline_m * f_px) * np.asarray(disparity_sigma_px, dtype=np.float64)
    )
    return sigma


def points_from_plane(
    left_plane_px: ArrayLike, depth_m: ArrayLike, *, f_px: float, baseline_m: float
) -> NDArray[np.float64]:
    """Return (n, 3) float64 points, m, rig frame.

    `left_plane_px`: (n, 2) (u, v) on the left virtual pinhole plane. `depth_m`: (n,) Z.
    """
    plane = as_rows(left_plane_px, columns=2, name="left_plane_px")
    z = np.asarray(depth_m, dtype=np.float64)
    if z.shape != (len(plane),):
        raise InvalidInput(f"depth_m: shape ({len(plane)},) is needed, {z.shape} was given")
    points = np.column_stack([plane / f_px * z[:, None], z])
    points[:, 0] -= baseline_m / 2.0
    return points


def range_sigma_m(
    points_rig_m: ArrayLike, depth_sigma: ArrayLike, *, baseline_m: float
) -> NDArray[np.float64]:
    """Return the standard error of the distance from the rig's origin, m.

    A change of Z moves a point along the left eye's ray: the distance changes by that step's part along
    the line of sight from the origin. `points_rig_m`: (n, 3); `depth_sigma`: (n,) or scalar, m.
    """
    points = as_rows(points_rig_m, columns=3, name="points_rig_m")
    step = points + np.array([baseline_m / 2.0, 0.0, 0.0])
    step = step / step[:, 2:]
    along = np.abs(np.sum(points * step, axis=1)) / np.linalg.norm(points, axis=1)
    sigma: NDArray[np.float64] = along * np.asarray(depth_sigma, dtype=np.float64)
    return sigma


@dataclass(frozen=True, slots=True, kw_only=True)
class RayIntersection:
    """The closest approach of two rays.

    `point_m`: (3,) middle of the shortest segment. `gap_m`: (3,) from the first ray to the second.
    `vertical_rad`: angle by which the second ray passes below the first, seen from the eyes.
    `in_front`: false when the rays diverge (they meet behind the rig, or nowhere).
    """

    point_m: NDArray[np.float64]
    gap_m: NDArray[np.float64]
    vertical_rad: float
    in_front: bool


def closest_approach(
    origin_a_m: ArrayLike, ray_a: ArrayLike, origin_b_m: ArrayLike, ray_b: ArrayLike
) -> RayIntersection:
    """Return the `RayIntersection` of two rays; origins (3,) m, rays (3,) of any length, one common frame."""
    origins = as_rows(np.array([origin_a_m, origin_b_m]), columns=3, name="origins")
    rays = as_rows(np.array([ray_a, ray_b]), columns=3, name="rays")
    rays = rays / np.linalg.norm(rays, axis=1, keepdims=True)
    between = origins[1] - origins[0]
    cosine = float(rays[0] @ rays[1])
    sine_squared = float(np.sum(np.cross(rays[0], rays[1]) ** 2))
    if sine_squared < 1e-18:  # a billionth of a radian: parallel as far as doubles can tell
        far = np.full(3, np.inf)
        return RayIntersection(point_m=far, gap_m=between, vertical_rad=0.0, in_front=False)
    along = np.array([between @ rays[0], between @ rays[1]])
    reach_a = (along[0] - cosine * along[1]) / sine_squared
    reach_b = (cosine * along[0] - along[1]) / sine_squared
    a, b = origins[0] + reach_a * rays[0], origins[1] + reach_b * rays[1]
    gap = b - a
    mean_reach = 0.5 * (abs(reach_a) + abs(reach_b))
    return RayIntersection(
        point_m=0.5 * (a + b),
        gap_m=gap,
        vertical_rad=float(np.arctan2(gap[1], mean_reach)),
        in_front=bool(reach_a > 0.0 and reach_b > 0.0),
    )
