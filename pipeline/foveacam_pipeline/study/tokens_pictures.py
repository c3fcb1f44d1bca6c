"""The pictures of Sec. 4.3: time against tokens (Fig. 5b), and Eq. 5 beside what was measured."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter, NullLocator

from foveacam_pipeline.study.findings import StudyFigure, drawing_of
from foveacam_pipeline.study.tokens import (
    BACKDROP_SHARE,
    STREAMS,
    TokenTimes,
    cost_ratio,
    exponent,
)

ATTENTION, LAYER, MODEL = "#0072B2", "#D55E00", "#333333"


def time_picture(measured: TokenTimes) -> StudyFigure:
    """Return time against tokens as a picture of the report."""
    return StudyFigure(
        name="token-time",
        title="Time of attention against tokens",
        caption="Attention alone follows the square of the number of tokens; a whole layer does so only "
        f"where attention outweighs its projections and its perceptron. {measured.device}.",
        drawing=drawing_of(time_drawing(measured)),
        figure="Fig. 5(b)",
    )


def time_drawing(measured: TokenTimes) -> Figure:
    """Draw milliseconds against tokens, attention and whole layer, with the square law through the last."""
    figure = Figure(figsize=(8.0, 4.6), layout="constrained")
    axes = figure.subplots()
    tokens = np.asarray(measured.tokens, dtype=np.float64)
    for name, colour, mark, times_s in (
        ("whole layer", LAYER, "s", measured.layer_s),
        ("attention alone", ATTENTION, "o", measured.attention_s),
    ):
        label = f"{name}, exponent {exponent(measured.tokens, times_s):.2f}"
        axes.plot(tokens, 1e3 * np.asarray(times_s), color=colour, marker=mark, linewidth=1.8, label=label)
    square = 1e3 * measured.attention_s[-1] * (tokens / tokens[-1]) ** 2
    axes.plot(tokens, square, "--", color=MODEL, linewidth=1.2, label="C(N) ~ N²")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xticks(tokens)
    axes.xaxis.set_minor_locator(NullLocator())
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(NullFormatter())
    axes.set_xlabel("tokens N")
    axes.set_ylabel("processor time, ms")
    axes.grid(visible=True, alpha=0.3)
    axes.legend(fontsize=10, loc="upper left")
    return figure


def ratio_picture(measured: TokenTimes | None) -> StudyFigure:
    """Return Eq. 5 beside what was measured as a picture of the report."""
    return StudyFigure(
        name="token-split",
        title="Cost of a backdrop and streams over that of all tokens at once",
        caption="At equal tokens attention costs what Eq. 5 says; a whole layer saves less, "
        "since all but its attention costs the same however the tokens are split."
        if measured is not None
        else "Eq. 5 alone: nothing was measured.",
        drawing=drawing_of(ratio_drawing(measured)),
        figure="Eq. 5",
    )


def ratio_drawing(measured: TokenTimes | None) -> Figure:
    """Draw the ratio against the number of streams: Eq. 5 as a line, measured ratios as marks."""
    figure = Figure(figsize=(8.0, 4.4), layout="constrained")
    axes = figure.subplots()
    total = 4096 if measured is None else measured.split_total
    streams = np.arange(1, max(STREAMS) + 1)
    axes.plot(
        streams,
        [cost_ratio(total, streams=int(k)) for k in streams],
        color=MODEL,
        marker=".",
        linewidth=1.4,
        label=r"Eq. 5: $(N_\mathrm{low}^2 + \sum N_i^2)\,/\,N^2$",
    )
    if measured is not None:
        at = [split.streams for split in measured.splits]
        for name, colour, mark, ratios in (
            ("measured, attention alone", ATTENTION, "o", [each.attention_ratio for each in measured.splits]),
            ("measured, whole layer", LAYER, "s", [each.layer_ratio for each in measured.splits]),
        ):
            axes.plot(at, ratios, mark, color=colour, markersize=8, label=name)
    axes.axhline(1.0, color="0.5", linestyle=":", linewidth=1.2, label="all tokens at once")
    axes.set_ylim(0.4, 1.06)
    axes.set_xlabel("foveal streams k")
    axes.set_ylabel("cost / cost of all tokens at once")
    axes.set_title(f"{total} tokens, {100.0 * BACKDROP_SHARE:.0f} % of them in the backdrop", fontsize=11)
    axes.grid(visible=True, alpha=0.3)
    axes.legend(fontsize=9, loc="lower right", ncols=2)
    return figure
