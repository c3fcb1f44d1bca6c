"""The distance of a target before any look at it: from what was measured about it earlier.

The depths about a target are averaged, the near ones above all. The error that is stated grows with how much
they differ, with how far away the nearest one is, and with the depths of all else in view, because something
else may stand there. The shares are fitted on clicks of the bench and street scenes.
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
"""Beyond the nearest sample weights fall to 1/e over so many wide px, and so much of its distance more."""
FARTHEST_PX = 190.0
"""Where the nearest sample is farther away, wide px, nothing is stated."""
SPREAD_SHARE = 0.5
"""Share of the spread of the weighted depths that counts as error."""
UNSEEN_PER_PX = 0.0015
"""Error for each wide px to the nearest sample, relative to the depth."""
LEAST_SHARE = 0.005
"""Least error, relative to the depth: what else is in the cell that was measured."""
MEASURED_PX = 6.0
"""So near to a sample a target lies in the cell that was measured, wide px."""
OTHER_CHANCE = 0.1
"""Chance that a target elsewhere is of another surface, as deep as anything else in the view."""
VAGUE_SHARE = 0.6
"""A distance with a larger relative error is not stated."""
BLANK_HALF_PX, BLANK_LEVELS = 4, 2.5
"""A patch of this half side that varies by less, grey levels, is blank: it may be the sky."""
ENCLOSING_SHARE, ENCLOSING_PX = 3.0, 24.0
"""Samples so many times as far as the nearest one, or so many wide px away, tell whether they enclose it."""


def known_distance(
    context: DepthContext, target: NDArray[np.float64], wide: Intrinsics, *, frame: Frame | None
) -> LocatedPoint | None:
    """Return where a target is as far as earlier looks tell, None where they do not.

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
    """Return the mean depth of samples weighted by how near they are, and its error, m."""
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
    """Return whether a wide frame shows nothing about (2,) tangents but a shade and noise."""
    x_px, y_px = wide.pixels(np.arctan(target)[None])[0].tolist()
    height, width = frame.image.shape[:2]
    x, y = int(x_px * width / wide.width), int(y_px * height / wide.height)
    rows = slice(max(0, y - BLANK_HALF_PX), y + BLANK_HALF_PX + 1)
    columns = slice(max(0, x - BLANK_HALF_PX), x + BLANK_HALF_PX + 1)
    patch = gray(to_uint8(replace(frame, image=frame.image[rows, columns])))
    return patch.size == 0 or float(patch.std()) < BLANK_LEVELS
