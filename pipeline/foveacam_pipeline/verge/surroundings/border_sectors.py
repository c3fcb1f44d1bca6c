"""The measured border of a blank region by direction from the target: one place speaks for each."""

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
"""Two places of one edge, 0.7 degrees apart at most, differ by so many standard errors at most."""


def middles_by_sector(found: Collection[BorderDepth], target: NDArray[np.float64]) -> list[BorderDepth]:
    """Return one place for each direction from the target, (2,) tangents: the middle of those there.

    Places that one eye alone shows are used only where both eyes show none nearby, and where a neighbouring
    place is as deep. `beyond` of the returned place is the median over all places of its edge, those of one
    eye included.
    """
    groups: dict[int, list[BorderDepth]] = {}
    for depth in sorted(found, key=lambda depth: depth.inverse_z_per_m):
        sector = int((turn_rad(np.array(depth.tangents), target) / math.tau + 0.5) * SECTORS) % SECTORS
        groups.setdefault(sector, []).append(depth)
    by_both = {k: [depth for depth in group if depth.by_both] for k, group in groups.items()}
    counted = {
        k: by_both[k] or [depth for depth in group if _goes_on(depth, found)]
        for k, group in groups.items()
        if by_both[k] or not any(by_both.get((k + side) % SECTORS) for side in (-1, 1))
    }
    return [_middle(those, groups[k]) for k, those in counted.items() if those]


def _middle(counted: list[BorderDepth], there: list[BorderDepth]) -> BorderDepth:
    """Return the middle of places that are sorted by depth; `there`: all in that direction."""
    middle = counted[len(counted) // 2]
    beyond = [one.beyond for one in there if one.beyond is not None and _as_deep(one, middle)]
    return replace(middle, beyond=median(beyond) if beyond else None)


def _as_deep(one: BorderDepth, other: BorderDepth) -> bool:
    return abs(one.inverse_z_per_m - other.inverse_z_per_m) <= BESIDE_SIGMAS * other.sigma_per_m


def _goes_on(depth: BorderDepth, found: Collection[BorderDepth]) -> bool:
    """Return whether the border goes on beside a place at its depth: a mismatch stands alone."""
    return any(
        other is not depth
        and apart(np.array(other.tangents), np.array(depth.tangents)) <= BESIDE_TAN
        and _as_deep(other, depth)
        for other in found
    )
