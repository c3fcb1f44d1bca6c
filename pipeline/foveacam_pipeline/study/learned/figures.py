"""The figures of Sec. 5: photometric error beside the error against the truth, and pairs (Fig. 12)."""

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from foveacam_pipeline.study.learned.outcomes import LearnedOutcome, Method, ShownPair
from foveacam_pipeline.study.learned.ranking import MEASURES, Rows, spread
from foveacam_pipeline.study.report.findings import StudyFigure, drawing_of

OWN, OTHER, REFERENCE = "#0072B2", "#D55E00", "#7f7f7f"
COLOURS = {
    Method.NO_PRIOR: OWN,
    Method.FULL_PRIOR: OWN,
    Method.ANNEALED: OWN,
    Method.GEOMETRY: OWN,
    Method.UNSIGNED: OTHER,
    Method.UNSIGNED_SHIFTED: OTHER,
}
SHOWN = {
    Method.TRUTH: "truth",
    Method.MONO: "monocular prior,\naligned to matches",
    Method.MATCHING: "semi-global\nmatching, raw",
    Method.UNSIGNED: "unsigned volume",
    Method.FULL_PRIOR: "ours, full-strength\nprior",
    Method.ANNEALED: "ours, annealed",
}
"""Rows of Fig. 12 under the pictures of both eyes."""


def errors_picture(rows: Rows) -> StudyFigure:
    """Return the figure of both errors of every method."""
    return StudyFigure(
        name="errors",
        title="The paper's error, and the error against the truth",
        caption="Mean over seeds, lines are one standard deviation. Left: photometric error, all pixels; the "
        "dashed line is that of the true disparity. Right: end-point error where both eyes see the surface.",
        drawing=drawing_of(errors_drawing(rows)),
        figure="Table 3",
    )


def errors_drawing(rows: Rows) -> Figure:
    """Draw both errors as bars, a method a row."""
    figure = Figure(figsize=(9.0, 4.8), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    names = [str(method) for method in rows]
    at = np.arange(len(names))
    for axes, key, label in (
        (left, "photometric", "photometric error"),
        (right, "epe_px", "end-point error, px"),
    ):
        found = [spread(each, MEASURES[key]) for each in rows.values()]
        means = [0.0 if each is None else each.mean for each in found]
        deviations = [0.0 if each is None else float(np.nan_to_num(each.deviation)) for each in found]
        colours = [COLOURS.get(method, REFERENCE) for method in rows]
        axes.barh(at, means, xerr=deviations, color=colours, error_kw={"elinewidth": 1.2})
        axes.set_xlabel(label)
        axes.grid(visible=True, axis="x", alpha=0.3)
    true = spread(rows[Method.TRUTH], MEASURES["photometric"])
    if true is not None:
        left.axvline(true.mean, color="0.2", linestyle="--", linewidth=1.0)
    left.set_yticks(at, names, fontsize=9)
    left.invert_yaxis()
    return figure


def pairs_picture(outcome: LearnedOutcome) -> StudyFigure:
    """Return Fig. 12: pictures of both eyes and the methods' disparities, a pair a column."""
    return StudyFigure(
        name="pairs",
        title="Held-out pairs side by side",
        caption="Both foveae, the true residual disparity, and the methods' disparities; one colour scale a "
        "pair, light is near, white is unknown. The paper's fourth row is wide-angle stereo by a foundation "
        "model, whose weights are not here.",
        drawing=drawing_of(pairs_drawing(outcome.shown)),
        figure="Fig. 12",
    )


def pairs_drawing(shown: tuple[ShownPair, ...]) -> Figure:
    """Draw the pairs in columns."""
    names = ["left", "right", *SHOWN.values()]
    figure = Figure(figsize=(2.6 * len(shown) + 1.4, 1.9 * len(names)), layout="constrained")
    grid = figure.subplots(len(names), len(shown), squeeze=False)
    for column, pair in enumerate(shown):
        truth_px = pair.disparities_px[Method.TRUTH]
        low_px, high_px = np.nanpercentile(truth_px, [1.0, 99.0]).tolist()
        pictures: list[NDArray[np.generic]] = [pair.left, pair.right]
        pictures += [pair.disparities_px[method] for method in SHOWN]
        for row, picture in enumerate(pictures):
            axes = grid[row, column]
            axes.imshow(picture, vmin=low_px, vmax=high_px, cmap="viridis", interpolation="nearest")
            axes.set_xticks([])
            axes.set_yticks([])
            if column == 0:
                axes.set_ylabel(names[row], fontsize=9)
    return figure
