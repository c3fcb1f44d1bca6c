"""Chooses the labels of the 3D scene that are shown: so few that none covers another. Pure functions."""

import math
from collections.abc import Hashable, Sequence
from typing import TypeVar

from foveacam_web.scene_values import Point

Name = TypeVar("Name", bound=Hashable)
MOST = 5
_APART_RAD = (math.radians(20.0), math.radians(2.0))
"""Least angle between two labels, seen from the rig, across and down: the size of one in that view."""


def free_labels(places: Sequence[tuple[Name, Point]], *, most: int = MOST) -> set[Name]:
    """Return the names of the places whose labels are free of each other; earlier places come first.

    `places`: names with the points where their labels stand, m, rig frame.
    """
    chosen: list[tuple[Name, float, float]] = []
    for name, (x_m, y_m, z_m) in places:
        ax_rad, ay_rad = math.atan2(x_m, z_m), math.atan2(y_m, z_m)
        free = all(
            abs(ax_rad - other_ax) >= _APART_RAD[0] or abs(ay_rad - other_ay) >= _APART_RAD[1]
            for _, other_ax, other_ay in chosen
        )
        if free and len(chosen) < most:
            chosen.append((name, ax_rad, ay_rad))
    return {name for name, _, _ in chosen}
