"""The figures of Fig. 8: the plan with prediction and observations, the contrast, and the scene."""

from collections.abc import Sequence

import cv2
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path
from shapely import Polygon, get_parts
from shapely.geometry.base import BaseGeometry

from foveacam_hardware.contract import Sighting
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.study.report.findings import StudyFigure, drawing_of
from foveacam_pipeline.study.visibility.observed import PlaceObservation
from foveacam_pipeline.study.visibility.standoff import StandoffRing
from foveacam_pipeline.study.visibility.toy_scene import TARGET_M, TILE_M, TILES, AgentPose, toy_map

SCENE_DPI = 130
SEEN, UNSEEN, MARK = "#0072B2", "#8a8a8a", "#D55E00"
REGION, OBSTACLE, TILE = "#009E73", "#5d4a3a", "#f1ede4"


def plan_picture(
    found: Sequence[PlaceObservation], predicted: Sequence[bool], region: BaseGeometry, ring: StandoffRing
) -> StudyFigure:
    """Return the figure of the plan (Fig. 8)."""
    return StudyFigure(
        name="plan",
        title="Where the target is observed: prediction and observation",
        caption="Plan of the simulated hall. Shaded: the region that the plan predicts. Dots: corners of "
        "tiles where the simulated rig stood, looked and verged; blue where it resolved the target from "
        "beyond Dₘᵢₙ by its own distance. Circled: the verdict differs from the prediction. Corners "
        "without a dot have no room for the rig.",
        drawing=drawing_of(plan_drawing(found, predicted, region, ring)),
        figure="Fig. 8",
    )


def contrast_picture(
    found: Sequence[PlaceObservation], in_sight: Sequence[bool], *, d_max_m: float, least: float
) -> StudyFigure:
    """Return the figure of contrast against distance."""
    return StudyFigure(
        name="contrast",
        title="What decides: contrast of the label's rows",
        caption="The contrast of a position is that of the poorer eye. Rows count as resolved above the "
        "dashed line: "
        "what an ideal lens leaves of lines that are a Rayleigh angle apart (Eq. 6 with that angle: Dₘₐₓ).",
        drawing=drawing_of(contrast_drawing(found, in_sight, d_max_m=d_max_m, least=least)),
    )


def scene_picture(sighting: Sighting, pose: AgentPose) -> StudyFigure:
    """Return the figure of the rig's wide and left frames at a pose."""
    return StudyFigure(
        name="scene",
        title="The scene as the rig sees it",
        caption=f"Simulated rig at ({pose.x_m:g}, {pose.y_m:g}) m: the wide camera's picture, and the left "
        "fovea's on the target's stand with its chequered labels.",
        drawing=drawing_of(scene_drawing(sighting)),
        figure="Fig. 8, left",
    )


def scene_drawing(sighting: Sighting) -> Figure:
    """Draw the wide picture and the left fovea's side by side."""
    figure = Figure(figsize=(7.6, 3.2), layout="constrained", dpi=SCENE_DPI)
    views = ((sighting.wide, "wide camera"), (sighting.left, "left fovea"))
    for axes, (frame, name) in zip(figure.subplots(1, 2), views, strict=True):
        image = to_uint8(frame)
        small = cv2.resize(image, None, fx=0.33, fy=0.33, interpolation=cv2.INTER_AREA)
        axes.imshow(small, cmap="gray", vmin=0, vmax=255, interpolation="none")
        axes.set_title(name, fontsize=11)
        axes.set_axis_off()
    return figure


def plan_drawing(
    found: Sequence[PlaceObservation], predicted: Sequence[bool], region: BaseGeometry, ring: StandoffRing
) -> Figure:
    """Draw tiles, obstacles, the predicted region, and a dot for each position."""
    figure = Figure(figsize=(7.6, 8.2), layout="constrained")
    axes = figure.subplots()
    _draw_hall(axes)
    for part in get_parts(region):
        axes.add_patch(_patch(part, facecolor=REGION, alpha=0.35, edgecolor=REGION, linewidth=1.0))
    for obstacle in toy_map().obstacles:
        axes.add_patch(_patch(obstacle, facecolor=OBSTACLE, edgecolor="black", linewidth=0.8))
    for radius_m, style in ((ring.inner_m, ":"), (ring.outer_m, "--")):
        turn_rad = np.linspace(0.0, 2.0 * np.pi, 361)
        x_m, y_m = TARGET_M[0] + radius_m * np.cos(turn_rad), TARGET_M[1] + radius_m * np.sin(turn_rad)
        axes.plot(x_m, y_m, style, color="black", linewidth=1.0)
    axes.plot(
        *TARGET_M, marker="*", markersize=17, color="#CC79A7", markeredgecolor="black", linestyle="none"
    )
    for one, expected in zip(found, predicted, strict=True):
        at_m = (one.pose.x_m, one.pose.y_m)
        axes.plot(*at_m, "o", markersize=7, color=SEEN if one.success else UNSEEN, markeredgecolor="white")
        if one.success != expected:
            axes.plot(*at_m, "o", markersize=15, color=MARK, markerfacecolor="none", markeredgewidth=2.0)
    _label_plan(figure, axes)
    return figure


def contrast_drawing(
    found: Sequence[PlaceObservation], in_sight: Sequence[bool], *, d_max_m: float, least: float
) -> Figure:
    """Draw contrast against the distance to the target, positions with and without a free line of sight."""
    figure = Figure(figsize=(7.6, 4.2), layout="constrained")
    axes = figure.subplots()
    distance_m = np.array([np.hypot(one.pose.x_m - TARGET_M[0], one.pose.y_m - TARGET_M[1]) for one in found])
    contrast = np.array([one.contrast for one in found])
    sight = np.array(in_sight, dtype=np.bool_)
    axes.plot(distance_m[sight], contrast[sight], "o", color=SEEN, label="line of sight free on the plan")
    axes.plot(distance_m[~sight], contrast[~sight], "x", color=MARK, label="an obstacle in it")
    axes.axhline(least, linestyle="--", color="black", label=f"least contrast, {least:.3f}")
    axes.axvline(d_max_m, linestyle=":", color="black", label=f"Dₘₐₓ = {d_max_m:.2f} m")
    axes.set_xlabel("distance to the target on the plan, m")
    axes.set_ylabel("contrast of the rows (0: not verged)")
    axes.grid(visible=True, alpha=0.3)
    axes.legend(fontsize=10)
    return figure


def _draw_hall(axes: Axes) -> None:
    half_m = TILES * TILE_M / 2.0
    chequer = np.indices((TILES, TILES)).sum(axis=0) % 2
    across, down = np.nonzero(chequer)
    for i, j in zip(across.tolist(), down.tolist(), strict=True):
        x_m, y_m = i * TILE_M - half_m, j * TILE_M
        tile = Polygon([(x_m, y_m), (x_m + TILE_M, y_m), (x_m + TILE_M, y_m + TILE_M), (x_m, y_m + TILE_M)])
        axes.add_patch(_patch(tile, facecolor=TILE, edgecolor="none"))
    axes.set_xlim(-half_m, half_m)
    axes.set_ylim(0.0, 2.0 * half_m)
    axes.set_aspect("equal")
    axes.set_xlabel("x, m (to the right)")
    axes.set_ylabel("y, m (forward)")


def _label_plan(figure: Figure, axes: Axes) -> None:
    def dot(colour: str, text: str) -> Line2D:
        return Line2D([], [], marker="o", linestyle="none", color=colour, label=text)

    circle = Line2D(
        [],
        [],
        marker="o",
        linestyle="none",
        color=MARK,
        markerfacecolor="none",
        markersize=12,
        markeredgewidth=2.0,
    )
    circle.set_label("differs from the prediction")
    star = Line2D([], [], marker="*", linestyle="none", color="#CC79A7", markersize=14, label="target")
    handles = [
        Patch(facecolor=REGION, alpha=0.35, label="predicted region"),
        Patch(facecolor=OBSTACLE, label="obstacle"),
        dot(SEEN, "observed"),
        dot(UNSEEN, "not observed"),
        circle,
        star,
        Line2D([], [], linestyle=":", color="black", label="Dₘᵢₙ"),
        Line2D([], [], linestyle="--", color="black", label="Dₘₐₓ"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=4, fontsize=10)
    axes.tick_params(labelsize=10)


def _patch(
    area: BaseGeometry, *, facecolor: str, edgecolor: str, alpha: float = 1.0, linewidth: float = 0.0
) -> PathPatch:
    """Return a polygon with its holes as one patch."""
    rings = [area.exterior, *area.interiors] if isinstance(area, Polygon) else []
    outline = Path.make_compound_path(*(Path(np.asarray(ring.coords), closed=True) for ring in rings))
    return PathPatch(outline, facecolor=facecolor, edgecolor=edgecolor, alpha=alpha, linewidth=linewidth)
