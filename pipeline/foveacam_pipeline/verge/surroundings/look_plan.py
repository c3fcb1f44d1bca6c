"""Plan of the looks at the border of a blank region by what they can still improve.

A look costs about a tenth of a second. The gain of the next one, as a share of the stated error, is predicted
from the gains before it; when it is too small, the plan ends.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.verge.surroundings.border_depth import BorderDepth
from foveacam_pipeline.verge.surroundings.infer import InferredDepth, spread_per_m

DIRECTIONS = 6
"""Largest number of directions in which the border is looked at."""
IN_VIEW_TAN = 0.014
"""Distance from a look's direction within which both foveae show a place: 0.8 degrees."""
LEVELS_PER_M = (0.2, 0.55)
"""1/Z of the looks that together cover every depth, the first all beyond 2 m. They do not depend on the
current estimate: looks at its depth alone would confirm what lies behind or before the target's own
border."""
SIDE_RAD = math.pi / 4.0
"""Places whose directions from a target differ by more are on different sides of it."""
FIRST_GAIN = 0.3
"""Expected gain of the first look."""
LEAST_GAIN = 0.1
"""Least expected gain of a look that is made."""
KEPT_SURE, KEPT_DOUBTFUL = 0.6, 0.8
"""Weight of the former expectation against a look's actual gain, for a certain answer and for a doubtful
one."""
SURE_SHARE = 0.03
"""Largest error of a certain answer, alternatives included, as a share of 1/Z."""


class LookPlan:
    """Chooses direction and depth of each next look at a border, until none is worth its time."""

    def __init__(self, target: NDArray[np.float64], places: Sequence[NDArray[np.float64]]) -> None:
        """`target`: (2,) tangents. `places`: (2,) tangents each, on the border."""
        self._target = target
        self._places = places
        self._tried: list[NDArray[np.float64]] = []
        self._levels: list[float] = []
        self._expected_gain = FIRST_GAIN

    def next_look(self, found: Mapping[int, BorderDepth]) -> tuple[NDArray[np.float64], float] | None:
        """Return (2,) tangents and 1/Z of the next look; None when none is worth it.

        `found`: the places measured so far, by index.
        """
        if self._expected_gain < LEAST_GAIN:
            return None
        if self._levels and not self._half_found(found):
            return self._tried[-1], self._levels.pop(0)
        direction = self._next_direction(found) if len(self._tried) < DIRECTIONS else None
        if direction is None:
            return None
        self._tried.append(direction)
        self._levels = list(LEVELS_PER_M)
        return direction, self._levels.pop(0)

    def note_gain(self, before: tuple[InferredDepth, ...], after: tuple[InferredDepth, ...]) -> None:
        """Update the expected gain by how a look changed the answer."""
        sure = bool(after) and spread_per_m(after) <= SURE_SHARE * after[0].inverse_z_per_m
        kept = KEPT_SURE if sure else KEPT_DOUBTFUL
        self._expected_gain = kept * self._expected_gain + (1.0 - kept) * gain_of(before, after)

    def _half_found(self, found: Mapping[int, BorderDepth]) -> bool:
        """Return whether both eyes measured half of the border near the last direction."""
        there = [k for k, place in enumerate(self._places) if apart(place, self._tried[-1]) <= IN_VIEW_TAN]
        return sum(k in found and found[k].by_both for k in there) >= 0.5 * len(there)

    def _next_direction(self, found: Mapping[int, BorderDepth]) -> NDArray[np.float64] | None:
        """Return the direction of the nearest part of the border that was not looked at yet.

        Sides of the target on which nothing was looked at or measured come first.
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
    """Return the gain of a look: relative fall of the error, or move of the answer in errors; 0 to 1."""
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
    """Return the distance between two directions, tangents."""
    return float(np.hypot(*(one - other)))


def _between_rad(one_rad: float, other_rad: float) -> float:
    return abs(math.remainder(one_rad - other_rad, math.tau))
