"""A square in which people walk in circles, as a scene file; and where a point of one of them is."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

CORNERS = 48
"""Points of a circle: straight pieces of 13 cm at a radius of 1 m."""
GROUND = """\
format = "foveacam-scene"
version = 1
title = "A square with people who walk in circles"

[materials]
paving = {kind="noise", color="#77706a", accent="#cfc5b6", contrast=1.3, coarsest_m=0.5, seed=2}
brick = {kind="noise", color="#7d3325", accent="#dd9068", contrast=1.6, coarsest_m=0.5, stretch=2.5, seed=4}
coat0 = {kind="noise", color="#1d2f55", accent="#6f8fc4", contrast=1.4, coarsest_m=0.08, seed=21}
coat1 = {kind="noise", color="#6f1f22", accent="#d8776b", contrast=1.4, coarsest_m=0.08, seed=22}
coat2 = {kind="noise", color="#7a5518", accent="#e3b95f", contrast=1.4, coarsest_m=0.08, seed=23}
coat3 = {kind="noise", color="#1f5a2a", accent="#7fc48a", contrast=1.4, coarsest_m=0.08, seed=24}

[[objects]]
name = "ground"
shape = "quad"
material = "paving"
position_m = [0, 1.5, 15]
size_m = [30, 30]
rotation_deg = [90, 0, 0]

[[objects]]
name = "wall"
shape = "quad"
material = "brick"
position_m = [0, -1, 25]
size_m = [40, 12]
"""
WALKER = """
[[objects]]
name = "walker {number}"
shape = "statue"
material = "coat{number}"
position_m = [{x_m:.4f}, 1.5, {z_m:.4f}]
height_m = 1.75
triangles = 2400
[objects.motion]
kind = "path"
closed = true
points_m = {points_m}
speed_m_per_s = {speed_m_per_s}
start_s = {start_s}
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Walker:
    """Somebody who walks around (x, z), m, at a radius and a speed, starting at `start_s`."""

    x_m: float
    z_m: float
    radius_m: float
    speed_m_per_s: float
    start_s: float = 0.0


def write_square(path: Path, walkers: Iterable[Walker]) -> Path:
    """Write the scene file and return its path."""
    people = "".join(_walker(number, walker) for number, walker in enumerate(walkers))
    path.write_text(GROUND + people, encoding="utf-8")
    return path


def _walker(number: int, walker: Walker) -> str:
    turns = [2.0 * math.pi * corner / CORNERS for corner in range(CORNERS)]
    points = [
        [
            round(walker.x_m + walker.radius_m * math.cos(turn), 5),
            1.5,
            round(walker.z_m + walker.radius_m * math.sin(turn), 5),
        ]
        for turn in turns
    ]
    return WALKER.format(
        number=number,
        x_m=walker.x_m,
        z_m=walker.z_m,
        points_m=points,
        speed_m_per_s=walker.speed_m_per_s,
        start_s=walker.start_s,
    )
