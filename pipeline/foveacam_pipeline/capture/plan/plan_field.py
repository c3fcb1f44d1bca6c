"""The largest grid whose every point both eyes can look at, at one distance."""

import math

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import OutOfRange, Role
from foveacam_pipeline.geometry.angles import angles_from_rays, rays_from_angles
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.mirror import MirrorModel

EYES = (Role.LEFT, Role.RIGHT)
STEP_DEG = 0.1
"""Step of the search, degrees; coarse enough for round sizes."""
_RIM = np.array(
    [
        (x, y)
        for x in (-1.0, -0.5, 0.0, 0.5, 1.0)
        for y in (-1.0, -0.5, 0.0, 0.5, 1.0)
        if max(abs(x), abs(y)) == 1.0
    ]
)


def largest_field_deg(
    calibration: Calibration, distance_m: float, *, centre_deg: tuple[float, float] = (0.0, 0.0)
) -> tuple[float, float]:
    """Return the half width and half height, degrees, of the largest grid that both eyes reach at a distance.

    Of all boxes about the centre, in steps of 0.1°, it has the largest area, and its directions are in the
    wide view. A short distance narrows it: each eye turns inwards by atan(0.1 m / Z). Raise OutOfRange when
    there is none.
    """
    field_deg = np.abs(np.rad2deg(calibration.wide.field_rad)).reshape(2, 2).max(axis=1)
    most = (np.abs(centre_deg) + field_deg) // STEP_DEG + 1
    best = _largest_in_hulls(calibration, distance_m, centre_deg, (int(most[0]), int(most[1])))
    while min(best) > 0 and not _steered(calibration, distance_m, centre_deg, best):
        best = best[0] - 1, best[1] - 1
    if min(best) < 1:
        raise OutOfRange(
            f"raster plan: no field about ax {centre_deg[0]:g}°, ay {centre_deg[1]:g}° is within reach of"
            f" both eyes at {distance_m:g} m; move its centre, or choose a larger distance"
        )
    return round(best[0] * STEP_DEG, 1), round(best[1] * STEP_DEG, 1)


def beyond_hull_rad(mirror: MirrorModel, gazes_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n,) float64: how far gazes, (n, 2) rad, lie outside the calibrated ones; negative inside."""
    edges = np.roll(mirror.hull_rad, -1, axis=0) - mirror.hull_rad
    lengths = np.linalg.norm(edges, axis=1)
    edges, corners = edges[lengths > 0.0], mirror.hull_rad[lengths > 0.0]
    outward = np.column_stack([edges[:, 1], -edges[:, 0]]) / lengths[lengths > 0.0, None]
    beyond: NDArray[np.float64] = (gazes_rad @ outward.T - np.sum(outward * corners, axis=1)).max(axis=1)
    return beyond


def _largest_in_hulls(
    calibration: Calibration, distance_m: float, centre_deg: tuple[float, float], most: tuple[int, int]
) -> tuple[int, int]:
    """Return the largest box, in steps, that lies in the wide view and in the hulls of both mirrors."""
    heights = np.arange(1, most[1] + 1)
    least, beyond = np.zeros_like(heights), np.full_like(heights, most[0] + 1)
    while int((beyond - least).max()) > 1:
        widths = (least + beyond) // 2
        directions = _rims_rad(centre_deg, np.column_stack([widths, heights]))
        inside = _in_wide(calibration, directions)
        for role in EYES:
            mirror = calibration.eye(role).mirror
            inside &= beyond_hull_rad(mirror, _gazes(calibration, role, directions, distance_m)) <= 0.0
        reached = inside.reshape(len(heights), -1).all(axis=1)
        least, beyond = np.where(reached, widths, least), np.where(reached, beyond, widths)
    best = int(np.argmax(least * heights))
    return int(least[best]), int(heights[best])


def _steered(
    calibration: Calibration, distance_m: float, centre_deg: tuple[float, float], box: tuple[int, int]
) -> bool:
    """Return whether both mirrors have volts for the edge of a box."""
    directions = _rims_rad(centre_deg, np.array([box]))
    return all(
        bool(calibration.eye(role).mirror.inside(_gazes(calibration, role, directions, distance_m)).all())
        for role in EYES
    )


def _rims_rad(centre_deg: tuple[float, float], boxes: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return (n * 16, 2) directions, rad, on the edges of boxes: (n, 2) half widths and heights in steps."""
    rims_deg = np.array(centre_deg) + STEP_DEG * boxes[:, None, :] * _RIM
    directions: NDArray[np.float64] = np.deg2rad(rims_deg).reshape(-1, 2)
    return directions


def _in_wide(calibration: Calibration, directions_rad: NDArray[np.float64]) -> NDArray[np.bool_]:
    x_px, y_px = calibration.wide.pixels(directions_rad).T
    right, bottom = calibration.wide.width - 0.5, calibration.wide.height - 0.5
    inside: NDArray[np.bool_] = (x_px >= -0.5) & (x_px <= right) & (y_px >= -0.5) & (y_px <= bottom)
    return inside


def _gazes(
    calibration: Calibration, role: Role, directions_rad: NDArray[np.float64], distance_m: float
) -> NDArray[np.float64]:
    """Return (n, 2) gazes, rad, of an eye that looks at `directions_rad`, (n, 2), at a distance."""
    if math.isinf(distance_m):
        return directions_rad
    targets_rig_m = distance_m * rays_from_angles(directions_rad)
    return angles_from_rays(targets_rig_m - calibration.pivot_rig_m(role))
