"""The measured border of a blank region by direction from the target: one place of each edge per sector."""

import math
from collections.abc import Collection
from dataclasses import replace
from statistics import median

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.verge.surroundings.border_depth import BorderDepth
from foveacam_pipeline.verge.surroundings.look_plan import apart, turn_rad

SECTORS = 8
BESIDE_TAN, BESIDE_SIGMAS = 0.012, 4.0
"""Largest distance, 0.7 degrees, and difference in standard errors between two places of one edge."""
ALONG_TAN = 0.024
"""Distance along an edge within which its places tell what lies beyond it."""
SAME_SHARE = 0.02
"""Places of one direction whose 1/Z differ by less, relative to 1/Z, are of one edge."""
EDGE_PLACES = 2
"""Number of places that make another edge in the same direction."""


def middles_by_sector(found: Collection[BorderDepth], target: NDArray[np.float64]) -> list[BorderDepth]:
    """Return the median place of each edge in each direction from the target, (2,) tangents.

    Places that only one eye shows are used only where both eyes show none nearby, and where a neighbouring
    place is as deep. `beyond` of the returned place is the median over all places about it of its edge, those
    of one eye included.
    """
    groups: dict[int, list[BorderDepth]] = {}
    for depth in sorted(found, key=lambda depth: depth.inverse_z_per_m):
        sector = int((turn_rad(np.array(depth.tangents), target) / math.tau + 0.5) * SECTORS) % SECTORS
        groups.setdefault(sector, []).append(depth)
    by_both = {k: [depth for depth in group if depth.by_both] for k, group in groups.items()}
    counted = [
        by_both[k] or [depth for depth in group if _goes_on(depth, found)]
        for k, group in groups.items()
        if by_both[k] or not any(by_both.get((k + side) % SECTORS) for side in (-1, 1))
    ]
    return [_middle(edge, found) for places in counted for edge in _edges(places)]


def _edges(places: list[BorderDepth]) -> list[list[BorderDepth]]:
    """Split places, sorted by depth, into edges of one depth each.

    A place alone at its depth is a mismatch and left out where another edge has several.
    """
    edges: list[list[BorderDepth]] = []
    for place in places:
        if edges and _one_edge(edges[-1][-1], place):
            edges[-1].append(place)
        else:
            edges.append([place])
    most = max((len(edge) for edge in edges), default=0)
    return [edge for edge in edges if len(edge) >= min(most, EDGE_PLACES)]


def _middle(edge: list[BorderDepth], found: Collection[BorderDepth]) -> BorderDepth:
    """Return the median of an edge's places, sorted by depth; `found`: all places."""
    middle = edge[len(edge) // 2]
    beyond = [
        one.beyond
        for one in found
        if one.beyond is not None and _as_deep(one, middle) and _apart(one, middle) <= ALONG_TAN
    ]
    return replace(middle, beyond=median(beyond) if beyond else None)


def _one_edge(one: BorderDepth, other: BorderDepth) -> bool:
    slack = max(SAME_SHARE * other.inverse_z_per_m, BESIDE_SIGMAS * other.sigma_per_m)
    return abs(one.inverse_z_per_m - other.inverse_z_per_m) <= slack


def _apart(one: BorderDepth, other: BorderDepth) -> float:
    return apart(np.array(one.tangents), np.array(other.tangents))


def _as_deep(one: BorderDepth, other: BorderDepth) -> bool:
    return abs(one.inverse_z_per_m - other.inverse_z_per_m) <= BESIDE_SIGMAS * other.sigma_per_m


def _goes_on(depth: BorderDepth, found: Collection[BorderDepth]) -> bool:
    """Return whether the border continues beside a place at its depth: a mismatch stands alone."""
    return any(
        other is not depth and _apart(other, depth) <= BESIDE_TAN and _as_deep(other, depth)
        for other in found
    )
