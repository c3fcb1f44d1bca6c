"""Drawings of maps: stealth and visibility around one target (Fig. 6), regions of many targets (Fig. 7)."""

import math
from collections.abc import Sequence
from itertools import combinations

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch, PathPatch
from matplotlib.path import Path
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry
from shapely.geometry.polygon import orient

from foveacam_pipeline.study.visibility.maps import FieldMap, PlanPoint
from foveacam_pipeline.study.visibility.regions import annulus, disc, feasible_regions, shadows
from foveacam_pipeline.study.visibility.standoff import StandoffRing

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00")
"""One colour for each target, distinct for the colour-blind (Okabe and Ito)."""

STEALTH, RESOLVED, FEASIBLE, OBSTACLE = "#D55E00", "#0072B2", "#009E73", "0.35"

RING_OF_FIG_6 = StandoffRing(inner_m=3.0, outer_m=5.0)
STRIP_OF_FIG_6 = StandoffRing(inner_m=4.0, outer_m=4.25)
OBSTACLES_OF_FIG_6 = (
    Polygon([(1.6, 1.5), (2.3, 1.9), (1.9, 2.5), (1.2, 2.1)]),
    Polygon([(-3.3, -0.3), (-2.6, -0.6), (-2.3, 0.5), (-3.1, 0.8)]),
    Polygon([(0.2, -2.0), (1.2, -2.4), (1.2, -1.6)]),
)


def patch_of(found: BaseGeometry, **style: object) -> PathPatch:
    """Return polygons with their holes as one matplotlib patch."""
    rings = [
        shapely.get_coordinates(ring)
        for part in map(orient, shapely.get_parts(found))  # holes turn the other way, and stay empty
        if isinstance(part, Polygon) and not part.is_empty
        for ring in (part.exterior, *part.interiors)
    ]
    codes = [
        code for ring in rings for code in (Path.MOVETO, *[Path.LINETO] * (len(ring) - 2), Path.CLOSEPOLY)
    ]
    corners = np.concatenate([np.empty((0, 2)), *rings])
    return PathPatch(Path(corners, codes), **style)


def duality_figure() -> Figure:
    """Draw Fig. 6: bounds that cross, an annulus between them, and the sectors that obstacles leave."""
    figure = Figure(figsize=(8.6, 3.5), layout="constrained")
    crossed, band, sectors = figure.subplots(1, 3)
    _plain(crossed, "(a) Dₘₐₓ ≤ Dₘᵢₙ: empty")
    _bounds(crossed, StandoffRing(inner_m=RING_OF_FIG_6.inner_m, outer_m=2.4))
    _plain(band, "(b) Dₘₐₓ > Dₘᵢₙ: an annulus")
    band.add_patch(patch_of(annulus((0.0, 0.0), RING_OF_FIG_6), color=FEASIBLE, alpha=0.35, linewidth=0.0))
    _bounds(band, RING_OF_FIG_6)
    _plain(sectors, "(c) with obstacles: sectors θᵢ")
    _draw_sectors(sectors)
    _bounds(sectors, RING_OF_FIG_6)
    figure.legend(
        handles=[
            Line2D([], [], color=STEALTH, linestyle="--", label="Dₘᵢₙ: nearer is noticed"),
            Line2D([], [], color=RESOLVED, label="Dₘₐₓ: farther is not resolved"),
            Patch(color=FEASIBLE, alpha=0.35, label="the observer may stand here (δR: a thin ring of it)"),
            Line2D([], [], color="black", marker="*", linestyle="", markersize=9, label="target"),
            Patch(color=OBSTACLE, label="obstacle"),
            Patch(facecolor="0.85", hatch="////", edgecolor="0.6", label="hidden by it"),
        ],
        loc="outside lower center",
        ncols=3,
        fontsize=9,
    )
    return figure


def map_figure(maps: Sequence[FieldMap], ring: StandoffRing, *, agent_radius_m: float) -> Figure:
    """Draw Fig. 7: the first map with an agent in two targets' regions, further ones as thumbnails."""
    figure = Figure(figsize=(8.6, 6.6), layout="constrained")
    grid = figure.add_gridspec(3, 4, width_ratios=(1.0, 1.0, 1.0, 1.0))
    main = figure.add_subplot(grid[:, :3])
    draw_regions(main, maps[0], ring, agent_radius_m=agent_radius_m, labelled=True)
    _draw_agent(main, maps[0], ring, agent_radius_m)
    main.set_title(
        f"Dₘᵢₙ = {ring.inner_m:g} m, Dₘₐₓ = {ring.outer_m:g} m; region: ring, in sight, room for the agent",
        fontsize=10,
    )
    for row, field in enumerate(maps[1:4]):
        small = figure.add_subplot(grid[row, 3])
        draw_regions(small, field, ring, agent_radius_m=agent_radius_m, labelled=False)
    figure.legend(
        handles=[
            *(
                Patch(color=COLOURS[n % len(COLOURS)], alpha=0.45, label=f"region of target {n}")
                for n in range(len(maps[0].targets_m))
            ),
            Patch(color=OBSTACLE, label="obstacle"),
            Line2D(
                [],
                [],
                color="0.4",
                linestyle="--",
                linewidth=0.8,
                label="Dₘᵢₙ and Dₘₐₓ of a target",
            ),
            Line2D([], [], color="black", linewidth=1.4, label="line of sight, in range"),
        ],
        loc="outside lower center",
        ncols=4,
        fontsize=9,
    )
    return figure


def draw_regions(
    axes: Axes, field: FieldMap, ring: StandoffRing, *, agent_radius_m: float, labelled: bool
) -> None:
    """Draw a map, its targets' regions, and their bounds; with axes and names where `labelled`."""
    x0, y0, x1, y1 = field.bounds_m
    axes.set(xlim=(x0, x1), ylim=(y0, y1), aspect="equal")
    for n, region in enumerate(feasible_regions(field, ring, agent_radius_m=agent_radius_m)):
        axes.add_patch(patch_of(region, color=COLOURS[n % len(COLOURS)], alpha=0.45, linewidth=0.0))
    for obstacle in field.obstacles:
        axes.add_patch(patch_of(obstacle, facecolor=OBSTACLE, linewidth=0.0))
    for n, at in enumerate(field.targets_m):
        for radius_m in (ring.inner_m, ring.outer_m) if labelled else ():
            axes.add_patch(Circle(at, radius_m, fill=False, color="0.4", linestyle="--", linewidth=0.8))
        size = 7.0 if labelled else 3.0
        axes.plot(*at, "o", color=COLOURS[n % len(COLOURS)], markeredgecolor="black", markersize=size)
        if labelled:
            axes.annotate(
                f"{n}", at, xytext=(6, 5), textcoords="offset points", fontsize=10, fontweight="bold"
            )
    if labelled:
        axes.set(xlabel="x, m", ylabel="y, m")
    else:
        axes.set(xticks=[], yticks=[])


def agent_position(
    field: FieldMap, regions: Sequence[BaseGeometry], *, inner_m: float
) -> tuple[PlanPoint, tuple[int, ...]] | None:
    """Return the roomiest point in two targets' regions outside every D_min, and the targets in sight there.

    None where the regions do not meet.
    """
    noticed = shapely.union_all([disc(at, inner_m) for at in field.targets_m])
    shared = [one.intersection(other).difference(noticed) for one, other in combinations(regions, 2)]
    rooms = [part for found in shared for part in shapely.get_parts(found) if isinstance(part, Polygon)]
    circles = [shapely.maximum_inscribed_circle(room) for room in rooms if room.area > 0.0]
    if not circles:
        return None
    x, y = max(circles, key=lambda circle: circle.length).coords[0]
    seen = tuple(n for n, region in enumerate(regions) if region.intersects(shapely.Point(x, y)))
    return (x, y), seen


def _draw_agent(axes: Axes, field: FieldMap, ring: StandoffRing, agent_radius_m: float) -> None:
    regions = feasible_regions(field, ring, agent_radius_m=agent_radius_m)
    found = agent_position(field, regions, inner_m=ring.inner_m)
    if found is None:
        return
    (x, y), seen = found
    for n in seen:
        tx, ty = field.targets_m[n]
        axes.plot([x, tx], [y, ty], color="black", linewidth=1.4)
    axes.add_patch(Circle((x, y), agent_radius_m, facecolor="white", edgecolor="black", zorder=4))
    axes.annotate(
        "agent",
        (x, y),
        xytext=(9, -3),
        textcoords="offset points",
        fontsize=10,
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0},
    )


def _draw_sectors(axes: Axes) -> None:
    ring = RING_OF_FIG_6
    field = FieldMap(bounds_m=(-6.0, -6.0, 6.0, 6.0), obstacles=OBSTACLES_OF_FIG_6, targets_m=((0.0, 0.0),))
    hidden = shadows(field, (0.0, 0.0), outer_m=ring.outer_m)
    around = annulus((0.0, 0.0), ring)
    axes.add_patch(
        patch_of(
            hidden.intersection(disc((0.0, 0.0), ring.outer_m)),
            facecolor="0.85",
            hatch="////",
            edgecolor="0.6",
            linewidth=0.0,
        )
    )
    free = around.difference(hidden)
    axes.add_patch(patch_of(free, color=FEASIBLE, alpha=0.35, linewidth=0.0))
    for obstacle in OBSTACLES_OF_FIG_6:
        axes.add_patch(patch_of(obstacle, facecolor=OBSTACLE, linewidth=0.0))
    strip = annulus((0.0, 0.0), STRIP_OF_FIG_6).difference(hidden)
    axes.add_patch(patch_of(strip, color=FEASIBLE, linewidth=0.0))
    axes.annotate(
        "δR", (-3.3, 2.45), (-4.9, 4.5), fontsize=10, arrowprops={"arrowstyle": "-", "color": "0.2"}
    )
    turns = sorted(math.atan2(part.centroid.y, part.centroid.x) for part in shapely.get_parts(free))
    for n, turn_rad in enumerate(turns, start=1):
        axes.text(
            3.5 * math.cos(turn_rad),
            3.5 * math.sin(turn_rad),
            f"θ{'₁₂₃₄₅'[n - 1]}",
            ha="center",
            va="center",
            fontsize=12,
        )


def _plain(axes: Axes, title: str) -> None:
    axes.set(xlim=(-5.6, 5.6), ylim=(-5.6, 5.6), aspect="equal", xticks=[], yticks=[])
    axes.set_title(title, fontsize=10)
    axes.axis("off")
    axes.plot(0.0, 0.0, "*", color="black", markersize=11)


def _bounds(axes: Axes, ring: StandoffRing) -> None:
    """Draw both circles, with their radii to the left and to the right."""
    for radius_m, colour, line, turn_rad, name in (
        (ring.inner_m, STEALTH, "--", 2.2, "Dₘᵢₙ"),
        (ring.outer_m, RESOLVED, "-", 0.25, "Dₘₐₓ"),
    ):
        axes.add_patch(Circle((0.0, 0.0), radius_m, fill=False, color=colour, linestyle=line, linewidth=1.6))
        end = (radius_m * math.cos(turn_rad), radius_m * math.sin(turn_rad))
        axes.annotate(
            "", end, (0.0, 0.0), arrowprops={"arrowstyle": "->", "color": colour, "shrinkA": 0, "shrinkB": 0}
        )
        box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.5}
        axes.text(end[0] * 0.5, end[1] * 0.5, name, fontsize=9, ha="center", va="center", bbox=box)
