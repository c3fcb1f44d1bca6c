"""Collect measured points around a target and the chance that each is of the target's surface.

Each look measures the depth of its whole field, coarsely: both foveae against the wide view. Of the hundreds
of points about a target only the nearest surfaces in each direction are used.
"""

import math
from collections.abc import Collection, Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.matching.correlation import score_map
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.verge.aim import EYES
from foveacam_pipeline.verge.looking.fixation_head import Observation
from foveacam_pipeline.verge.matching.wide_patch import WidePatch, cut_view
from foveacam_pipeline.verge.surroundings.blank_region import BlankRegion
from foveacam_pipeline.verge.surroundings.border_depth import BorderDepth
from foveacam_pipeline.verge.surroundings.depth_samples import DepthSamples
from foveacam_pipeline.verge.surroundings.divisions import SAME_SHARE
from foveacam_pipeline.verge.surroundings.infer import OWN_CHANCE
from foveacam_pipeline.wide_depth.surfaces import cell_surfaces
from foveacam_pipeline.wide_depth.wide_matches import eye_matches

REACH_TAN = 0.06
"""Radius about a target in which earlier measurements are used: 3.4 degrees."""
SECTORS = 8
BAND_PX = 4.0
"""Points of one direction that are at most this much farther than the nearest are used with it, wide px."""
WINDOW_PX, SAME_SIGMAS = 16.0, 3.0
"""Largest reach of an edge's depth into a blank region by the matcher's window, px of the picture; standard
errors within which depths are the same."""
INSIDE_CHANCE, BORDER_CHANCE, BEYOND_CHANCE = 0.9, 0.4, 0.25
"""Chance that a point is of a blank region's surface: well within it, near its border, beyond it."""
BORDER_PX = 8.0
"""Reach of a nearer surface into a blank one by the matcher's windows, wide px."""
NEAR_CHANCE, FAR_CHANCE = 0.93, 0.55
"""Chance that a point is of a textured target's surface: at the target, and far from it."""
NEAR_PX = 5.0
"""Distance in which that chance falls by 1/e, wide px."""
OWN_EDGE_CHANCE, SHARED_EDGE_CHANCE = 0.98, 0.4
"""Chance that an edge is of the region that it borders: with farther things beyond it, and without."""
STAYS_SCORE, ALONG_SCORE = 0.85, 0.96
"""Correlations at an edge's depth of what lies beyond it: below the first it is farther away, above the
second as deep as the edge (of 1 400 rendered edges 2 and 7 % do otherwise)."""
SKYLINE_M = 15.0
"""Least distance of the skyline; the walls and ceilings of a room are nearer."""
OPEN_EDGES = 3
"""Number of own edges from which a region at the rim of the image counts as a surface, not as the sky."""
BEYOND_COUNT, BEYOND_REACH_PX = 8, 28.0
"""Number of points, and their distance from an edge, wide px, that determine what lies beyond it."""
REPEAT_REACH_PX, REPEAT_ROWS_PX = 90, 2
"""Range to either side of a patch, and rows, in which its repetition is searched for, survey px."""
REPEAT_SCORE, REPEAT_DIP = 0.9, 0.75
"""Least correlation of a repetition, and the largest in between."""
TEXTURED_SHARE = 1e-4
"""Least share of the wide image of a blank region; below it the target has texture."""


class LookPoints:
    """Points that either fovea shows in each look, computed once a look."""

    def __init__(self, calibration: Calibration) -> None:
        self._calibration = calibration
        self._shown: dict[int, DepthSamples] = {}

    def of(self, looks: Iterable[Observation]) -> DepthSamples:
        """Return all points of some looks."""
        found = DepthSamples.none()
        for observation in looks:
            found = found.joined(self._of_one(observation))
        return found

    def _of_one(self, observation: Observation) -> DepthSamples:
        key = observation.sighting.left.t_ns
        if key not in self._shown:
            left, right = (eye_matches(observation.sighting, self._calibration, role) for role in EYES)
            self._shown[key] = left.joined(right)
        return self._shown[key]


def repeats_in_row(
    gray: NDArray[np.uint8], wide: Intrinsics, template: WidePatch, target: NDArray[np.float64]
) -> bool:
    """Return whether the patch of a target repeats in its own row: then no match can be trusted.

    A patch that fits all the way, as an edge along the row does, does not repeat. `gray`: (h, w) wide image.
    `target`: (2,) tangents.
    """
    half_y, half_x = ((side - 1) // 2 for side in template.patch.shape)
    half = (half_x + REPEAT_REACH_PX, half_y + REPEAT_ROWS_PX)
    view = cut_view(gray, wide, target, f_px=template.f_px, half=half)
    scores = score_map(view, template.patch).max(axis=0)
    for outward in (scores[REPEAT_REACH_PX:], scores[REPEAT_REACH_PX::-1]):
        apart = np.flatnonzero(outward < REPEAT_DIP)
        if len(apart) and float(outward[apart[0] :].max()) >= REPEAT_SCORE:
            return True
    return False


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
    """Return (n,) the chance that points at wide pixels, (n, 2), are of the surface of a region's target."""
    if region.area_share >= TEXTURED_SHARE:
        depth_px = region.depth_px(pixels)
        return np.where(
            depth_px >= BORDER_PX,
            INSIDE_CHANCE,
            np.where(depth_px >= -BORDER_PX, BORDER_CHANCE, BEYOND_CHANCE),
        )
    return textured_chances(np.hypot(*(pixels - region.at_px).T))


def beside_edges(
    points: DepthSamples, edges: Collection[BorderDepth], *, reach_tan: float
) -> NDArray[np.bool_]:
    """Return (n,) bool: whether a point has the depth of an edge within reach and may be that edge."""
    found = np.zeros(len(points), dtype=np.bool_)
    for edge in edges:
        near = np.hypot(*(points.tangents - np.array(edge.tangents)).T) <= reach_tan
        errors = SAME_SIGMAS * np.hypot(points.sigma_per_m, edge.sigma_per_m)
        slack = np.maximum(SAME_SHARE * edge.inverse_z_per_m, errors)
        found |= near & (np.abs(points.inverse_z_per_m - edge.inverse_z_per_m) <= slack)
    return found


def edge_owners(
    edges: Sequence[BorderDepth], points: DepthSamples, region: BlankRegion, wide: Intrinsics
) -> NDArray[np.float64]:
    """Return (n,) the chance that edges on a region's border are of the region's surface.

    An edge has the depth of the nearer of the two surfaces that meet there. If what lies beyond is farther
    away, the edge is the region's own. Where pictures do not decide, measured points do.
    """
    pixels = wide.pixels(np.arctan(points.tangents)) if len(points) else np.empty((0, 2))
    beyond = region.depth_px(pixels) <= -BORDER_PX
    pixels, q = pixels[beyond], points.inverse_z_per_m[beyond]
    return np.array([_own_chance(edge, pixels, q, wide) for edge in edges])


def _own_chance(
    edge: BorderDepth, pixels: NDArray[np.float64], q: NDArray[np.float64], wide: Intrinsics
) -> float:
    """Return the chance of one edge. `pixels`: (n, 2) of points beyond the border. `q`: (n,) their 1/Z."""
    if edge.beyond is not None and edge.beyond < STAYS_SCORE:
        return OWN_EDGE_CHANCE
    if edge.beyond is not None and edge.beyond > ALONG_SCORE:
        return SHARED_EDGE_CHANCE
    off_px = np.hypot(*(pixels - wide.pixels(np.arctan(np.array(edge.tangents))[None])[0]).T)
    near = np.argsort(off_px)[:BEYOND_COUNT]
    near = near[off_px[near] <= BEYOND_REACH_PX]
    if len(near) == 0:
        return OWN_CHANCE
    behind = (
        1.0 - float(q[near].max()) / edge.inverse_z_per_m
    )  # beyond a thin thing lies the background again
    slack = max(SAME_SHARE, 4.0 * edge.sigma_per_m / edge.inverse_z_per_m)
    return OWN_EDGE_CHANCE if behind > slack else SHARED_EDGE_CHANCE


def is_open(region: BlankRegion, samples: DepthSamples, chances: NDArray[np.float64]) -> bool:
    """Return whether a region may be the sky: it reaches the rim, hides hardly anything, and ends far away.

    `samples`: measured on its border. `chances`: (n,) that these are of its surface.
    """
    if not region.touches_rim or int((chances >= OWN_EDGE_CHANCE).sum()) >= OPEN_EDGES:
        return False
    return len(samples) < OPEN_EDGES or float(np.median(samples.inverse_z_per_m)) < 1.0 / SKYLINE_M


def textured_chances(off_px: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n,) the chance that points this many wide px from a textured target are of its surface."""
    near = np.exp(-off_px / NEAR_PX)
    return np.asarray(FAR_CHANCE + (NEAR_CHANCE - FAR_CHANCE) * near, dtype=np.float64)
