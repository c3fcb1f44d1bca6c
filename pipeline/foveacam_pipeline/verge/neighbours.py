"""Measured points about a target: from the looks at it, a few that stand for all, and what they may tell.

Each look tells the depth of its whole field, coarsely: both foveae against the wide view. Of the hundreds of
points about a target the nearest surfaces in each direction from it matter.
"""

import math
from collections.abc import Iterable

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.context.surfaces import cell_surfaces
from foveacam_pipeline.context.wide_matches import eye_matches
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.verge.aim import EYES
from foveacam_pipeline.verge.blank_region import BlankRegion
from foveacam_pipeline.verge.depth_samples import DepthSamples
from foveacam_pipeline.verge.looking import Seen
from foveacam_pipeline.verge.template import Template, cut_view

REACH_TAN = 0.02
"""So far about a target points count: 1.1 degrees."""
SECTORS = 8
BAND_PX = 4.0
"""Points of one direction that lie farther than the nearest by so much count with it, wide px."""
INSIDE_CHANCE = 0.9
"""Chance of a point within the target's blank region to be of its surface."""
BEYOND_CHANCE = 0.4
"""The same of a point beyond the border of that region."""
NEAR_CHANCE, FAR_CHANCE = 0.93, 0.55
"""The same of a point about a target with texture: at the target, and far from it."""
NEAR_PX = 5.0
"""How fast the chance falls with the distance, wide px."""
REPEAT_REACH_PX, REPEAT_ROWS_PX = 90, 2
"""A patch is looked for in its own row so far to either side, survey px."""
REPEAT_GUARD_PX = 10
"""So near it is the patch itself, survey px."""
REPEAT_SCORE = 0.9
TEXTURED_SHARE = 1e-4
"""A region that is a smaller share of the wide image is none: the target has texture."""


def samples_of_looks(
    looks: Iterable[Seen], calibration: Calibration, target: NDArray[np.float64]
) -> DepthSamples:
    """Return the points about a target, (2,) tangents, that either fovea shows in some looks."""
    found = DepthSamples.none()
    for seen in looks:
        for role in EYES:
            found = found.joined(
                eye_matches(seen.sighting, calibration, role).near(target, reach_tan=REACH_TAN)
            )
    return found


def repeats_in_row(
    gray: NDArray[np.uint8], wide: Intrinsics, template: Template, target: NDArray[np.float64]
) -> bool:
    """Return whether the patch of a target fits its own row elsewhere as well: then no match can be trusted.

    `gray`: (h, w) wide image. `target`: (2,) tangents.
    """
    half_y, half_x = ((side - 1) // 2 for side in template.patch.shape)
    half = (half_x + REPEAT_REACH_PX, half_y + REPEAT_ROWS_PX)
    view = cut_view(gray, wide, target, f_px=template.f_px, half=half)
    scores = np.nan_to_num(cv2.matchTemplate(view, template.patch, cv2.TM_CCOEFF_NORMED)).max(axis=0)
    scores[REPEAT_REACH_PX - REPEAT_GUARD_PX : REPEAT_REACH_PX + REPEAT_GUARD_PX + 1] = -1.0
    return float(scores.max()) >= REPEAT_SCORE


def few_around(samples: DepthSamples, target: NDArray[np.float64], *, px_tan: float) -> DepthSamples:
    """Return the nearest one or two surfaces in each direction from a target.

    `px_tan`: a wide px, tangents.
    """
    if len(samples) == 0:
        return samples
    offsets = samples.tangents - target
    distance = np.hypot(*offsets.T)
    turn = (np.arctan2(offsets[:, 1], offsets[:, 0]) + math.pi) / (2.0 * math.pi)
    sector = np.floor(turn * SECTORS).astype(np.int64) % SECTORS
    nearest = np.full(SECTORS, math.inf)
    np.minimum.at(nearest, sector, distance)
    kept = distance <= nearest[sector] + BAND_PX * px_tan
    surfaces = cell_surfaces(samples.only(kept), sector[kept])
    few = DepthSamples(
        tangents=surfaces.tangents,
        inverse_z_per_m=surfaces.inverse_z_per_m,
        sigma_per_m=surfaces.sigma_per_m,
    )
    return few.only(np.argsort(np.hypot(*(few.tangents - target).T)))


def own_chances(pixels: NDArray[np.float64], region: BlankRegion) -> NDArray[np.float64]:
    """Return (n,) the chance of points at wide pixels, (n, 2), to be of the surface of a region's target."""
    if region.area_share >= TEXTURED_SHARE:
        return np.where(region.holds(pixels), INSIDE_CHANCE, BEYOND_CHANCE)
    distance_px = np.hypot(*(pixels - region.at_px).T)
    return np.asarray(
        FAR_CHANCE + (NEAR_CHANCE - FAR_CHANCE) * np.exp(-distance_px / NEAR_PX), dtype=np.float64
    )
