"""Compute the field that each eye reaches, as an outline in the wide image."""

import math

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.geometry.angles import angles_from_rays
from foveacam_pipeline.geometry.verging import point_on_ray
from foveacam_pipeline.models.calibration import Calibration

SAMPLE_RAD = math.radians(1.0)
"""Sampling of the edges of a mirror's field; between samples they bend by less than half a wide pixel."""


def reach_outline_px(
    calibration: Calibration, role: Role, *, distance_m: float = math.inf
) -> NDArray[np.float64]:
    """Return (n, 2) float64 wide px of the outline of the calibrated field of an eye.

    The outline is taken at `distance_m` from the rig's origin, or at infinity, and may leave the wide image.
    Raise OutOfRange for a distance nearer than the eye itself.
    """
    tangents = np.tan(_sampled(calibration.eye(role).mirror.hull_rad))
    rays = np.column_stack([tangents, np.ones(len(tangents))])
    if math.isfinite(distance_m):
        pivot = calibration.pivot_rig_m(role)
        rays = np.array([point_on_ray(pivot, ray, distance_m) for ray in rays])
    return calibration.wide.pixels(angles_from_rays(rays))


def outline_margin_px(outline_px: NDArray[np.float64], points_px: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n,) the distance of points (n, 2) from a convex outline (m, 2), px; negative outside."""
    edges = np.roll(outline_px, -1, axis=0) - outline_px
    lengths = np.linalg.norm(edges, axis=1)
    edges, starts = edges[lengths > 0.0] / lengths[lengths > 0.0, None], outline_px[lengths > 0.0]
    beside = points_px[:, None, :] - starts[None]
    inward = edges[None, :, 0] * beside[..., 1] - edges[None, :, 1] * beside[..., 0]
    turn = np.sign(_area_px2(outline_px))
    return np.asarray((turn * inward).min(axis=1), dtype=np.float64)


def _area_px2(outline_px: NDArray[np.float64]) -> float:
    """Return twice the signed area of a polygon, px squared."""
    x, y = outline_px.T
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def _sampled(hull_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the corners of a closed outline with points between them, rad."""
    parts = []
    for start, end in zip(hull_rad, np.roll(hull_rad, -1, axis=0), strict=True):
        count = max(1, math.ceil(float(np.linalg.norm(end - start)) / SAMPLE_RAD))
        parts.append(start + np.arange(count)[:, None] / count * (end - start))
    return np.concatenate(parts)
