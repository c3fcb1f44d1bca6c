"""The distance of a target before any look at it, from earlier measurements around it.

It is an average weighted towards near samples. The stated error grows with their spread, with the distance of
the nearest one, and with the depths of everything else in view, because another object may be there. The
factors were fitted on clicks of the bench and street scenes.
"""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Frame
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.verge.distance import LocatedPoint
from foveacam_pipeline.verge.surroundings.depth_samples import DepthContext, DepthSamples
from foveacam_pipeline.verge.surroundings.infer import encloses

EVERYWHERE_TAN = 10.0
WEIGHT_PX, WEIGHT_SHARE = 3.0, 0.5
"""Range over which weights fall to 1/e beyond the nearest sample: wide px, plus a share of its distance."""
FARTHEST_PX = 190.0
"""Largest distance of the nearest sample at which a depth is stated, wide px."""
SPREAD_SHARE = 0.5
"""Factor from the spread of the weighted depths to their error."""
UNSEEN_PER_PX = 0.0015
"""Relative error of the depth per wide px to the nearest sample."""
LEAST_SHARE = 0.005
"""Least relative error of the depth: a measured cell may hold something else too."""
MEASURED_PX = 6.0
"""Distance from a sample within which a target lies in the measured cell, wide px."""
OTHER_CHANCE = 0.1
"""Chance that a target outside the cell is of another surface, as deep as anything else in the view."""
VAGUE_SHARE = 0.6
"""A distance with a larger relative error is not stated."""
BLANK_HALF_PX, BLANK_LEVELS = 4, 2.5
"""Half side of a patch, and the contrast, grey levels, below which it is blank: it may be the sky."""
ENCLOSING_SHARE, ENCLOSING_PX = 3.0, 24.0
"""Reach of the samples that must enclose a blank target: a multiple of the nearest one's distance, or wide px
if that is more."""


def known_distance(
    context: DepthContext, target: NDArray[np.float64], wide: Intrinsics, *, frame: Frame | None
) -> LocatedPoint | None:
    """Return a target's point by earlier measurements; None where they do not determine it.

    `target`: (2,) tangents. `frame`: a wide frame that shows it; without one it counts as blank.
    """
    samples = context.around(target, reach_tan=EVERYWHERE_TAN)
    measured = samples.only(samples.inverse_z_per_m > 0.0)
    if len(measured) == 0:
        return None
    offsets_px = (measured.tangents - target) * wide.fx_px
    apart_px = np.hypot(*offsets_px.T)
    nearest_px = float(apart_px.min())
    if nearest_px > FARTHEST_PX:
        return None
    about = apart_px <= max(ENCLOSING_PX, ENCLOSING_SHARE * nearest_px)
    if (frame is None or is_blank(frame, target, wide)) and not encloses(offsets_px[about]):
        return None
    z_m, sigma_m = _weighted_depth(measured, apart_px, nearest_px=nearest_px)
    if sigma_m > VAGUE_SHARE * z_m:
        return None
    length = math.hypot(*target.tolist(), 1.0)
    x_m, y_m = (target * z_m).tolist()
    return LocatedPoint(
        point_rig_m=(x_m, y_m, z_m), distance_m=length * z_m, distance_sigma_m=length * sigma_m
    )


def _weighted_depth(
    samples: DepthSamples, apart_px: NDArray[np.float64], *, nearest_px: float
) -> tuple[float, float]:
    """Return the mean depth of samples weighted by proximity, and its error, m."""
    weights = np.exp(-(apart_px - nearest_px) / (WEIGHT_PX + WEIGHT_SHARE * nearest_px))
    weights /= weights.sum()
    depths_m = 1.0 / samples.inverse_z_per_m
    z_m = float(weights @ depths_m)
    spread_m = SPREAD_SHARE * math.sqrt(float(weights @ (depths_m - z_m) ** 2))
    measured_m = math.sqrt(float(weights @ (samples.sigma_per_m * depths_m**2) ** 2))
    unseen_m = (LEAST_SHARE + UNSEEN_PER_PX * nearest_px) * z_m
    chance = 0.0 if nearest_px < MEASURED_PX else OTHER_CHANCE
    other_m = math.sqrt(chance * float(np.mean((depths_m - z_m) ** 2)))
    return z_m, math.hypot(spread_m, measured_m, unseen_m, other_m)


def is_blank(frame: Frame, target: NDArray[np.float64], wide: Intrinsics) -> bool:
    """Return whether a wide frame shows nothing about (2,) tangents but shading and noise."""
    x_px, y_px = wide.pixels(np.arctan(target)[None])[0].tolist()
    height, width = frame.image.shape[:2]
    x, y = int(x_px * width / wide.width), int(y_px * height / wide.height)
    rows = slice(max(0, y - BLANK_HALF_PX), y + BLANK_HALF_PX + 1)
    columns = slice(max(0, x - BLANK_HALF_PX), x + BLANK_HALF_PX + 1)
    patch = gray(to_uint8(replace(frame, image=frame.image[rows, columns])))
    return patch.size == 0 or float(patch.std()) < BLANK_LEVELS
