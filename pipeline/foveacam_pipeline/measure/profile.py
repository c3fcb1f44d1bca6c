"""Measure depth along a line in the window of a look."""

import math
from dataclasses import dataclass

import numpy as np

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.measure.look import LookDepth
from foveacam_pipeline.measure.point import point_of

MOST = 400
"""Largest number of samples of a profile."""
SHORTEST_PX = 3.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ProfileSample:
    """One sample of the line: window pixel, length along it, depth and its matching error (None unknown)."""

    x_px: float
    y_px: float
    along_m: float
    z_m: float | None
    z_sigma_m: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthProfile:
    """Depth along a line.

    `along_m` of the samples is measured on a surface that faces the rig at the profile's median depth.
    `pose_sigma_m`: standard error of Z that all samples share, m.
    """

    samples: tuple[ProfileSample, ...]
    median_z_m: float
    pose_sigma_m: float


def profile_along(
    look: LookDepth, start_px: tuple[float, float], end_px: tuple[float, float]
) -> DepthProfile:
    """Return depth from one window pixel to another, about one sample a pixel, at most `MOST`."""
    start, end = np.array(start_px), np.array(end_px)
    long_px = float(np.linalg.norm(end - start))
    if long_px < SHORTEST_PX:
        raise InvalidInput(
            f"a profile of {long_px:.1f} px is too short",
            asked=f"a line of {long_px:.1f} px",
            remedy=f"drag a line of {SHORTEST_PX:g} px or more",
        )
    count = min(MOST, math.ceil(long_px) + 1)
    pixels = start + (end - start) * np.linspace(0.0, 1.0, count)[:, None]
    width, height = look.size_px
    columns, rows = np.rint(pixels).astype(np.int64).T
    inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
    z_m, sigma_px = np.full(count, np.nan), np.full(count, np.nan)
    z_m[inside] = look.z_m[rows[inside], columns[inside]]
    sigma_px[inside] = look.sigma_px[rows[inside], columns[inside]]
    if not np.isfinite(z_m).any():
        raise InvalidInput(
            "no pixel on the line has a depth",
            asked="a profile",
            found="no depth along the line",
            remedy="drag it over texture that both eyes see",
        )
    median_z_m = float(np.nanmedian(z_m))
    middle = point_of(
        look, (float(pixels[:, 0].mean()), float(pixels[:, 1].mean())), median_z_m, sigma_px=0.0, look_id=""
    )
    along_m = np.linspace(0.0, 1.0, count) * long_px * median_z_m / look.f_px
    sigma_m = z_m**2 / (look.f_px * look.baseline_m) * sigma_px
    samples = tuple(
        ProfileSample(
            x_px=x,
            y_px=y,
            along_m=along,
            z_m=z if math.isfinite(z) else None,
            z_sigma_m=sigma if math.isfinite(z) else None,
        )
        for (x, y), along, z, sigma in zip(
            pixels.tolist(), along_m.tolist(), z_m.tolist(), sigma_m.tolist(), strict=True
        )
    )
    return DepthProfile(samples=samples, median_z_m=median_z_m, pose_sigma_m=middle.sigma_m[2])
