"""The figures of Fig. 4: the scene, error against distance (c), trajectories at each standoff (d-f)."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from foveacam_hardware.contract import Sighting
from foveacam_pipeline.study.localisation.accuracy import COVERAGE, aligned
from foveacam_pipeline.study.localisation.experiment import Pair
from foveacam_pipeline.study.localisation.rail import infinity_m
from foveacam_pipeline.study.localisation.summary import PairOutcome
from foveacam_pipeline.study.report.findings import StudyFigure, drawing_of
from foveacam_pipeline.study.tradeoff.depth_error import COLOURS
from foveacam_pipeline.study.visibility.observed_figures import scene_drawing

MARKERS = {Pair.WIDE: "s", Pair.FOVEA: "o"}
NAMES = {Pair.WIDE: "wide pair", Pair.FOVEA: "foveae"}
ASIDE = {Pair.WIDE: 0.985, Pair.FOVEA: 1.015}
"""Factors on the distance by which the markers of both pairs stand beside each other."""


def scene_picture(sighting: Sighting, standoff_m: float) -> StudyFigure:
    """Return the figure of the wide and the left frame with the figurine on the middle of its rail."""
    return StudyFigure(
        name="scene",
        title="The figurine on its rail",
        caption=f"Simulated rig, rail at {standoff_m:g} m: the wide camera's picture, and the left fovea's.",
        drawing=drawing_of(scene_drawing(sighting)),
        figure="Fig. 4(a, b)",
    )


def error_picture(found: Sequence[PairOutcome]) -> StudyFigure:
    """Return the figure of the error against the distance (c)."""
    return StudyFigure(
        name="error",
        title="Localisation error of the wide pair and of the foveae",
        caption="Large markers: RMS of the 3D position after alignment of the centroids, with bootstrap "
        f"intervals of {COVERAGE:.0%}. Small open markers: drift, the mean offset of the centroids. Dashed: "
        "the Cramér-Rao bound of the depth by the noise of the pictures.",
        drawing=drawing_of(error_drawing(found)),
        figure="Fig. 4(c)",
    )


def trajectory_picture(found: Sequence[PairOutcome]) -> StudyFigure:
    """Return the figure of the trajectories from above (d-f)."""
    return StudyFigure(
        name="trajectories",
        title="Estimated trajectories against the rail",
        caption="The rail from above, aligned at the centroids. Black: the infinity sign and its slots. "
        "Joined markers: the first run; small dots: the other runs.",
        drawing=drawing_of(trajectory_drawing(found)),
        figure="Fig. 4(d-f)",
    )


def error_drawing(found: Sequence[PairOutcome]) -> Figure:
    """Draw RMS with intervals, drift and bound against the distance, on logarithmic axes."""
    figure = Figure(figsize=(7.0, 4.8), layout="constrained")
    axes = figure.subplots()
    for pair in Pair:
        here = [one for one in found if one.pair is pair]
        _draw_errors(axes, pair, [one for one in here if one.errors is not None])
        z_m, bound_mm = [one.standoff_m for one in here], [1e3 * one.bound_m for one in here]
        axes.plot(z_m, bound_mm, "--", color=COLOURS[pair], label=f"{NAMES[pair]}: bound by noise")
    standoffs_m = sorted({one.standoff_m for one in found})
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xticks(standoffs_m, [f"{z_m:g}" for z_m in standoffs_m])
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.set_xlabel("distance of the rail, m")
    axes.set_ylabel("error, mm")
    axes.grid(visible=True, axis="y", alpha=0.3)
    figure.legend(loc="outside lower center", ncols=2, fontsize=9)
    return figure


def _draw_errors(axes: Axes, pair: Pair, here: Sequence[PairOutcome]) -> None:
    errors = [one.errors for one in here if one.errors is not None]
    z_m = np.array([one.standoff_m for one in here])
    rms_mm = 1e3 * np.array([each.rms.value for each in errors])
    ends_mm = 1e3 * np.array([[each.rms.low, each.rms.high] for each in errors]).reshape(-1, 2).T
    drift_mm = 1e3 * np.array([np.linalg.norm(each.drift_m) for each in errors])
    colour = COLOURS[pair]
    axes.plot(
        z_m * ASIDE[pair], rms_mm, f"{MARKERS[pair]}-", color=colour, markersize=8,
        label=f"{NAMES[pair]}: RMS, aligned",
    )  # fmt: skip
    axes.errorbar(
        z_m * ASIDE[pair], rms_mm, yerr=np.abs(ends_mm - rms_mm), fmt="none", color=colour, capsize=4
    )
    axes.plot(
        z_m * ASIDE[pair], drift_mm, MARKERS[pair], color=colour, fillstyle="none", markersize=5,
        label=f"{NAMES[pair]}: drift",
    )  # fmt: skip


def trajectory_drawing(found: Sequence[PairOutcome]) -> Figure:
    """Draw, for each standoff, the true infinity sign and the estimates of both pairs."""
    standoffs_m = sorted({one.standoff_m for one in found})
    figure = Figure(figsize=(4.2 * len(standoffs_m), 4.4), layout="constrained")
    panels = figure.subplots(1, len(standoffs_m), squeeze=False)[0]
    for axes, standoff_m in zip(panels, standoffs_m, strict=True):
        here = [one for one in found if one.standoff_m == standoff_m]
        _draw_trajectories(axes, here)
        axes.set_title(f"{standoff_m:g} m", fontsize=11)
    panels[0].set_ylabel("depth from the rail's centre, mm")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=10)
    return figure


def _draw_trajectories(axes: Axes, here: Sequence[PairOutcome]) -> None:
    across_m, away_m = infinity_m(np.linspace(0.0, 2.0 * np.pi, 361))
    axes.plot(1e3 * across_m, 1e3 * away_m, color="black", linewidth=1.0, label="rail")
    for one in here:
        centre_m = one.truth_m.mean(axis=0)
        away = 1e3 * (aligned(one.points_m, one.truth_m) - centre_m)
        colour, marker = COLOURS[one.pair], MARKERS[one.pair]
        axes.plot(away[1:, :, 0].ravel(), away[1:, :, 2].ravel(), ".", color=colour, alpha=0.35, markersize=4)
        closed = np.vstack([away[0], away[0, :1]])
        axes.plot(
            closed[:, 0], closed[:, 2], f"{marker}-", color=colour, linewidth=0.7, markersize=5,
            label=NAMES[one.pair],
        )  # fmt: skip
    truth = 1e3 * (here[0].truth_m - here[0].truth_m.mean(axis=0))
    axes.plot(truth[:, 0], truth[:, 2], "x", color="black", markersize=5)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("across, mm")
    axes.grid(visible=True, alpha=0.3)
