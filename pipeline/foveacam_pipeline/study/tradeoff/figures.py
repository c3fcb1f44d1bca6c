"""The figures of Sec. 4.2: gains by bin (Fig. 5a), T against the budget, and the positions of the patches."""

import math
from collections.abc import Sequence

import cv2
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import FuncFormatter, NullFormatter, NullLocator

from foveacam_pipeline.study.report.findings import StudyFigure, drawing_of
from foveacam_pipeline.study.tradeoff.depth_metrics import DepthMetric
from foveacam_pipeline.study.tradeoff.patches import PatchChoice
from foveacam_pipeline.study.tradeoff.streets import StereoScene
from foveacam_pipeline.study.tradeoff.sweep import (
    CHOICE_LABELS,
    HEADLINE_SHARE,
    METRIC_LABELS,
    PAPER_RATIOS,
    READINGS,
    BudgetPoint,
    BudgetSweep,
    ratios_of,
)

GAIN, LOSS, COVER = "#0072B2", "#D55E00", "#009E73"
CHOICE_COLOURS = {PatchChoice.TRUTH: "#0072B2", PatchChoice.ESTIMATE: "#E69F00"}
INTERVAL_SHIFTS = {PatchChoice.TRUTH: 0.975, PatchChoice.ESTIMATE: 1.025}
"""Factors by which intervals are shifted along q, so that they do not hide each other."""
READING_LINES = {"mean": "-", "sum": "--"}
PLACE_STYLES = {PatchChoice.TRUTH: ("#56B4E9", "-"), PatchChoice.ESTIMATE: ("#E69F00", "--")}
FARTHEST_SHOWN = 30.0
"""T beyond this, or infinite, is drawn at this value."""
LEAST_SHOWN = 0.03


def bins_picture(found: BudgetSweep, *, source: str, prefix: str = "") -> StudyFigure:
    """Return the figure of gains and coverage by bin."""
    share = found.at(HEADLINE_SHARE, PatchChoice.TRUTH).share
    return StudyFigure(
        name=f"{prefix.replace('_', '-')}tradeoff-bins",
        title=f"Change of AbsRel by depth, {source}",
        caption=f"FOV against MR at q = {share:g}: blue bins gain, orange bins lose, lines are standard "
        "errors over scenes. Below, the share of each bin that patches cover.",
        drawing=drawing_of(bins_drawing(found)),
        figure="Fig. 5(a)",
    )


def bins_drawing(found: BudgetSweep) -> Figure:
    """Draw the gain in AbsRel of every bin, and the share of it that patches cover, for both choices."""
    figure = Figure(figsize=(8.4, 5.4), layout="constrained")
    grid = figure.subplots(2, 2, sharex=True, sharey="row", height_ratios=(2.0, 1.0))
    for column, choice in enumerate(PatchChoice):
        point = found.at(HEADLINE_SHARE, choice)
        _gain_bars(grid[0, column], point)
        _coverage_bars(grid[1, column], point)
        grid[0, column].set_title(f"{CHOICE_LABELS[choice]}, q = {point.share:g}", fontsize=11)
        grid[1, column].set_xlabel("tenth of the pixels, its mean depth in m")
    grid[0, 0].set_ylabel("gain in AbsRel, MR − FOV")
    grid[1, 0].set_ylabel("covered by\npatches, %")
    handles = [
        Rectangle((0.0, 0.0), 1.0, 1.0, color=colour, label=label)
        for colour, label in ((GAIN, "FOV better than MR"), (LOSS, "FOV worse than MR"), (COVER, "coverage"))
    ]
    figure.legend(handles=handles, fontsize=9, loc="outside lower center", ncols=3)
    return figure


def _gain_bars(axes: Axes, point: BudgetPoint) -> None:
    gain = np.nan_to_num(point.gains(DepthMetric.ABSREL))
    at = np.arange(len(gain))
    colours = [GAIN if each > 0.0 else LOSS for each in gain]
    errors = np.nan_to_num(point.gain_errors(DepthMetric.ABSREL))
    axes.bar(at, gain, color=colours, yerr=errors, error_kw={"ecolor": "0.25", "elinewidth": 1.0})
    axes.axhline(0.0, color="0.2", linewidth=0.8)
    ratio = point.ratio(DepthMetric.ABSREL)
    axes.text(
        0.03,
        0.92,
        f"T = {_shown(ratio.mean)} (means), {_shown(ratio.total)} (sums)",
        transform=axes.transAxes,
        fontsize=9,
    )
    axes.grid(visible=True, axis="y", alpha=0.3)
    axes.margins(y=0.15)


def _coverage_bars(axes: Axes, point: BudgetPoint) -> None:
    covered = 100.0 * np.nan_to_num(point.mean(lambda each: each.coverage))
    axes.bar(np.arange(len(covered)), covered, color=COVER)
    axes.set_ylim(0.0, 100.0)
    depths_m = point.mean(lambda each: each.bin_depth_m)
    axes.set_xticks(np.arange(len(depths_m)), [f"{depth_m:.0f}" for depth_m in depths_m])
    axes.grid(visible=True, axis="y", alpha=0.3)


def _shown(ratio: float) -> str:
    return "∞" if math.isinf(ratio) else f"{ratio:.2f}"


def ratio_picture(found: BudgetSweep, *, source: str, prefix: str = "") -> StudyFigure:
    """Return the figure of T against the budget."""
    return StudyFigure(
        name=f"{prefix.replace('_', '-')}tradeoff-ratio",
        title=f"Near-far trade-off ratio against the budget, {source}",
        caption="Above 1 far gains outweigh near losses. Upright lines: 90 % intervals of the ratio of means "
        "over scenes drawn anew; bins that hardly change come out on either side then, so that marks may lie "
        "outside. Marks at an edge lie at it or beyond: no bin is degraded, or none improved.",
        drawing=drawing_of(ratio_drawing(found)),
    )


def ratio_drawing(found: BudgetSweep) -> Figure:
    """Draw T of every metric against q: both readings, both choices of patches, and the paper's value."""
    figure = Figure(figsize=(8.4, 4.4), layout="constrained")
    row = figure.subplots(1, len(DepthMetric), sharey=True)
    for axes, metric in zip(row, DepthMetric, strict=True):
        for choice, points in found.points.items():
            for name, line in READING_LINES.items():
                ratios = ratios_of(points, metric, READINGS[name])
                axes.plot(
                    found.shares,
                    _clamped(ratios),
                    line,
                    marker="o",
                    markersize=4,
                    color=CHOICE_COLOURS[choice],
                    label=f"{CHOICE_LABELS[choice]}, {name}s",
                )
            _intervals(axes, points, metric, choice=choice)
        axes.axhline(
            PAPER_RATIOS[metric], color="0.35", linestyle="-.", linewidth=1.2, label="the paper's value"
        )
        axes.axhline(1.0, color="0.6", linewidth=0.8)
        axes.set_title(f"{METRIC_LABELS[metric]}, paper {PAPER_RATIOS[metric]:g}", fontsize=11)
        _scaled(axes, found)
    row[0].set_ylabel("trade-off ratio T")
    handles, labels = row[0].get_legend_handles_labels()
    figure.legend(handles, labels, fontsize=9, loc="outside lower center", ncols=3)
    return figure


def _intervals(
    axes: Axes, points: tuple[BudgetPoint, ...], metric: DepthMetric, *, choice: PatchChoice
) -> None:
    """Draw the interval of T (of means) over scenes, always with the same resampling."""
    for point in points:
        ends = _clamped([end.mean for end in point.interval(metric, seed=0)])
        share = INTERVAL_SHIFTS[choice] * point.share
        axes.vlines(share, ends[0], ends[1], color=CHOICE_COLOURS[choice], alpha=0.6, linewidth=1.4)


def _clamped(ratios: Sequence[float]) -> list[float]:
    return [min(max(ratio, LEAST_SHOWN), FARTHEST_SHOWN) for ratio in ratios]


def _scaled(axes: Axes, found: BudgetSweep) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_ylim(LEAST_SHOWN, 1.1 * FARTHEST_SHOWN)
    axes.set_xticks([share for share in (0.04, 0.0625, 0.11, 0.25, 0.5) if share in found.shares])
    axes.xaxis.set_minor_locator(NullLocator())
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(NullFormatter())
    axes.tick_params(axis="x", labelsize=8)
    axes.set_xlabel("q, share of native pixels")
    axes.grid(visible=True, alpha=0.3)


def patches_picture(found: BudgetSweep, scene: StereoScene) -> StudyFigure:
    """Return the figure of the patches on the first scene."""
    return StudyFigure(
        name="tradeoff-places",
        title=f"Where the patches lie, {scene.name}",
        caption="Native patches on the left image, and on the true depth; grey: not judged.",
        drawing=drawing_of(patches_drawing(found, scene)),
    )


def patches_drawing(found: BudgetSweep, scene: StereoScene) -> Figure:
    """Draw the patches of both choices over the left image and its true depth; `scene` was swept first."""
    figure = Figure(figsize=(8.4, 5.6), layout="constrained")
    upper, lower = figure.subplots(2, 1)
    height, width = scene.truth_z_m.shape
    extent = (0.0, float(width), float(height), 0.0)
    small = cv2.resize(scene.left, (width // 2, height // 2), interpolation=cv2.INTER_AREA)
    upper.imshow(small, extent=extent)
    depth_m = np.where(scene.seen, scene.truth_z_m, np.nan)[::2, ::2]
    lower.set_facecolor("0.75")
    shown = lower.imshow(np.log10(depth_m), extent=extent, cmap="cividis", interpolation="nearest")
    bar = figure.colorbar(shown, ax=lower, label="true depth, m", pad=0.01)
    nearest_m, farthest_m = np.nanmin(depth_m), np.nanmax(depth_m)
    ticks_m = [each for each in (5.0, 10.0, 20.0, 40.0, 80.0) if nearest_m < each < farthest_m]
    bar.set_ticks([math.log10(each) for each in ticks_m], labels=[f"{each:g}" for each in ticks_m])
    for choice in PatchChoice:
        for axes in (upper, lower):
            _outline(axes, found.at(HEADLINE_SHARE, choice), choice)
    share = found.at(HEADLINE_SHARE, PatchChoice.TRUTH).share
    upper.set_title(f"{scene.name}, q = {share:g}", fontsize=11)
    upper.legend(fontsize=9, loc="upper right")
    for axes in (upper, lower):
        axes.set_ylabel("y, px")
    lower.set_xlabel("x, px")
    return figure


def _outline(axes: Axes, point: BudgetPoint, choice: PatchChoice) -> None:
    """Draw the patches of the first scene."""
    colour, line = PLACE_STYLES[choice]
    size = point.sizes.patch
    for number, place in enumerate(point.outcomes[0].places):
        outline = Rectangle(
            (place.x_px, place.y_px),
            size.width,
            size.height,
            fill=False,
            linewidth=2.0,
            linestyle=line,
            edgecolor=colour,
            label=CHOICE_LABELS[choice] if number == 0 else None,
        )
        axes.add_patch(outline)
