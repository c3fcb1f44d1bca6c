"""Plan the looks at the border of a blank region by what they can still change.

A look costs about a tenth of a second. What the next one is expected to gain, as a share of the stated error,
is judged by what the looks before it gained; when that is too little, the plan ends.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.verge.surroundings.border_depth import BorderDepth
from foveacam_pipeline.verge.surroundings.infer import InferredDepth, spread_per_m

DIRECTIONS = 6
"""So many directions are looked at for the border, at most."""
IN_VIEW_TAN = 0.014
"""A place so near to a look's direction is within both foveae's fields: 0.8 degrees."""
LEVELS_PER_M = (0.2, 0.55)
"""1/Z of the looks that together show every depth, where nothing is known: the first shows all beyond 2 m."""
SIDE_RAD = math.pi / 4.0
"""Places seen from a target in directions that differ by more are on different sides of it."""
FIRST_GAIN = 0.3
"""What the first look is expected to gain."""
LEAST_GAIN = 0.1
"""A look that is expected to gain less is not made."""
KEPT_SURE, KEPT_DOUBTFUL = 0.5, 0.7
"""Weight of the expectation against what a look really gained, where the answer is sure, and where not."""
SURE_SHARE = 0.03
"""An answer is sure when its error, rival answers included, is a smaller share of 1/Z."""


class LookPlan:
    """Chooses direction and depth of each next look at a border, until none is worth its time."""

    def __init__(self, target: NDArray[np.float64], places: Sequence[NDArray[np.float64]]) -> None:
        """`target`: (2,) tangents. `places`: (2,) tangents each, on the border."""
        self._target = target
        self._places = places
        self._tried: list[NDArray[np.float64]] = []
        self._levels: list[float] = []
        self._expected_gain = FIRST_GAIN

    def next_look(
        self, found: Mapping[int, BorderDepth], inferred: tuple[InferredDepth, ...]
    ) -> tuple[NDArray[np.float64], float] | None:
        """Return (2,) tangents and 1/Z of the next look; None when none is worth it.

        `found`: the places measured until now, by index. `inferred`: what they say, most probable first.
        """
        if self._expected_gain < LEAST_GAIN:
            return None
        if self._levels and not inferred and not self._all_found(found):
            return self._tried[-1], self._levels.pop(0)
        direction = self._next_direction(found) if len(self._tried) < DIRECTIONS else None
        if direction is None:
            return None
        self._tried.append(direction)
        self._levels = [inferred[0].inverse_z_per_m] if inferred else list(LEVELS_PER_M)
        return direction, self._levels.pop(0)

    def note_gain(self, before: tuple[InferredDepth, ...], after: tuple[InferredDepth, ...]) -> None:
        """Take into account what a look changed of the answer."""
        sure = bool(after) and spread_per_m(after) <= SURE_SHARE * after[0].inverse_z_per_m
        kept = KEPT_SURE if sure else KEPT_DOUBTFUL
        self._expected_gain = kept * self._expected_gain + (1.0 - kept) * gain_of(before, after)

    def _all_found(self, found: Mapping[int, BorderDepth]) -> bool:
        """Return whether both eyes measured half of the border about the last direction."""
        there = [k for k, place in enumerate(self._places) if apart(place, self._tried[-1]) <= IN_VIEW_TAN]
        return sum(k in found and found[k].by_both for k in there) >= 0.5 * len(there)

    def _next_direction(self, found: Mapping[int, BorderDepth]) -> NDArray[np.float64] | None:
        """Return the direction to the nearest stretch of the border that was not looked at.

        A side of the target on which nothing was looked at or measured comes before all others.
        """
        left = [
            place
            for index, place in enumerate(self._places)
            if index not in found and all(apart(place, other) > IN_VIEW_TAN for other in self._tried)
        ]
        if not left:
            return None
        known = [*self._tried, *(np.array(depth.tangents) for depth in found.values())]
        sides = [turn_rad(place, self._target) for place in known]
        fresh = [
            place
            for place in left
            if all(_between_rad(turn_rad(place, self._target), side) > SIDE_RAD for side in sides)
        ]
        nearest = min(fresh or left, key=lambda place: apart(place, self._target))
        stretch = [place for place in left if apart(place, nearest) <= IN_VIEW_TAN]
        middle = np.mean(stretch, axis=0)
        return np.asarray(nearest + 0.7 * (middle - nearest), dtype=np.float64)


def gain_of(before: tuple[InferredDepth, ...], after: tuple[InferredDepth, ...]) -> float:
    """Return what a look changed: by how much the error fell or the answer moved, in errors; 0 to 1."""
    if not after or not before:
        return float(bool(after) and not before)
    error, later = spread_per_m(before), spread_per_m(after)
    moved = abs(after[0].inverse_z_per_m - before[0].inverse_z_per_m)
    return min(1.0, max(0.0, 1.0 - later / error, moved / error))


def turn_rad(place: NDArray[np.float64], target: NDArray[np.float64]) -> float:
    """Return the direction from a target to a place in the image."""
    x, y = place - target
    return math.atan2(y, x)


def apart(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    """Return the distance of two directions, tangents."""
    return float(np.hypot(*(one - other)))


def _between_rad(one_rad: float, other_rad: float) -> float:
    return abs(math.remainder(one_rad - other_rad, math.tau))
