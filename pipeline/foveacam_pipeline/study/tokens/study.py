"""The study of Sec. 4.3: the quadratic cost of attention, and what backdrop and streams save (Eq. 5).

Here are its values, its comparison with the paper, and its figures. The cost model is in `cost`, the timing
in `learn.attention`.
"""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter, NullLocator

from foveacam_pipeline.study.report.findings import (
    PaperComparison,
    StudyFigure,
    StudyResult,
    Value,
    drawing_of,
)
from foveacam_pipeline.study.tokens.cost import (
    BACKDROP_SHARE,
    STREAMS,
    TokenTimes,
    cost_ratio,
    eq5_error,
    exponent,
    token_count,
)

MODEL_TOTAL = 4096
SAVING_STREAMS = 4
"""`layer_saving` is reported for a backdrop and this many streams."""
NO_TORCH = "timing attention needs torch; pip install 'foveacam-duo[learn]'"


def tokens_study(
    *, quick: bool = False, measured: TokenTimes | None = None, not_measured: str = NO_TORCH
) -> StudyResult:
    """Return the study of Sec. 4.3.

    `measured`: the times from `learn.attention.measure`; without them the model is reported alone, and
    `not_measured` says why. `quick`: the times are of fewer tokens, which the result states.
    """
    pictures = [ratio_picture(measured)]
    if measured is not None:
        pictures.insert(0, time_picture(measured))
    return StudyResult(
        name="tokens",
        section="4.3",
        title="Token reduction",
        values={**_model_values(measured), **_measured_values(measured)},
        rows=(*_model_rows(), *_measured_rows(measured, not_measured)),
        pictures=tuple(pictures),
        definitions=_definitions(measured),
        deviations=_deviations(measured, quick=quick, not_measured=not_measured),
    )


def _total(measured: TokenTimes | None) -> int:
    return MODEL_TOTAL if measured is None else measured.split_total


def _model_values(measured: TokenTimes | None) -> dict[str, Value]:
    total = _total(measured)
    ratios: dict[str, Value] = {str(k): cost_ratio(total, streams=k) for k in STREAMS}
    return {"split_tokens": total, "backdrop_share": BACKDROP_SHARE, "eq5_ratio_by_streams": ratios}


def _measured_values(measured: TokenTimes | None) -> dict[str, Value]:
    if measured is None:
        names = (
            "attention_exponent",
            "layer_exponent",
            "eq5_max_rel_error",
            "layer_saving",
            "attention_ratio_by_streams",
            "layer_ratio_by_streams",
        )
        return dict.fromkeys(names)
    layer: dict[str, Value] = {str(split.streams): split.layer_ratio for split in measured.splits}
    attention: dict[str, Value] = {str(split.streams): split.attention_ratio for split in measured.splits}
    return {
        "attention_exponent": exponent(measured.tokens, measured.attention_s),
        "layer_exponent": exponent(measured.tokens, measured.layer_s),
        "eq5_max_rel_error": eq5_error(measured),
        "layer_saving": layer_saving(measured),
        "attention_ratio_by_streams": attention,
        "layer_ratio_by_streams": layer,
        "tokens": list(measured.tokens),
        "attention_ms": [1e3 * time_s for time_s in measured.attention_s],
        "layer_ms": [1e3 * time_s for time_s in measured.layer_s],
        "measured_on": measured.device,
    }


def layer_saving(measured: TokenTimes) -> float | None:
    """Return the share of a layer's time that a backdrop and four streams save; None if not measured."""
    found = [1.0 - split.layer_ratio for split in measured.splits if split.streams == SAVING_STREAMS]
    return found[0] if found else None


def _model_rows() -> tuple[PaperComparison, ...]:
    ratios = ", ".join(f"{cost_ratio(MODEL_TOTAL, streams=k):.3f}" for k in STREAMS)
    return (
        PaperComparison(
            quantity="tokens of an image, N = H W / P²",
            paper="N = HW/P²",
            ours=f"{token_count(1246, 378, patch_px=14)} for 1246 x 378 px, P = 14 px",
            note="the size of Sec. 4.2's images, padded to whole patches",
        ),
        PaperComparison(
            quantity="Eq. 5: C_FOV / C_MR at equal tokens, "
            f"{100.0 * BACKDROP_SHARE:.0f} % backdrop and k = {_counts()} streams",
            paper="< 1, no number given",
            ours=ratios,
            note=f"never below {BACKDROP_SHARE**2:.4g}, the backdrop's own attention",
        ),
    )


def _measured_rows(measured: TokenTimes | None, not_measured: str) -> tuple[PaperComparison, ...]:
    slope = "latency against tokens, exponent of attention"
    law = f"measured attention, backdrop and k = {_counts(measured)} streams over all tokens at once"
    layer = "the same for a whole transformer layer"
    if measured is None:
        missing = f"not measured: {not_measured}"
        return (
            PaperComparison(quantity=slope, paper="2 (Fig. 5b: quadratic)", ours=missing),
            PaperComparison(quantity=law, paper="Eq. 5", ours=missing),
            PaperComparison(quantity=layer, paper="not stated", ours=missing),
        )
    found, saved = measured.splits, layer_saving(measured)
    return (
        PaperComparison(
            quantity=slope,
            paper="2 (Fig. 5b: quadratic)",
            ours=f"{exponent(measured.tokens, measured.attention_s):.2f}",
            note=f"{measured.tokens[0]} to {measured.tokens[-1]} tokens; a whole layer: "
            f"{exponent(measured.tokens, measured.layer_s):.2f}; {measured.device}",
        ),
        PaperComparison(
            quantity=law,
            paper="Eq. 5",
            ours=", ".join(f"{split.attention_ratio:.3f}" for split in found),
            note=f"off Eq. 5 by at most {100.0 * eq5_error(measured):.1f} % for k of 2 and more",
        ),
        PaperComparison(
            quantity=layer,
            paper="not stated",
            ours=", ".join(f"{split.layer_ratio:.3f}" for split in found),
            note=""
            if saved is None
            else f"a layer saves {100.0 * saved:.0f} % with {SAVING_STREAMS} streams",
        ),
    )


def _counts(measured: TokenTimes | None = None) -> str:
    streams = STREAMS if measured is None else tuple(split.streams for split in measured.splits)
    return ", ".join(str(k) for k in streams)


def _definitions(measured: TokenTimes | None) -> tuple[str, ...]:
    notes = [
        "Attention: scaled dot products among all tokens of a stream. Streams do not see one another.",
        f"Equal tokens: backdrop and streams have together the {_total(measured)} tokens that the uniform "
        f"image has; the backdrop has {100.0 * BACKDROP_SHARE:.0f} % of them, the streams share the "
        "rest evenly.",
    ]
    if measured is not None:
        notes.append(
            f"Layer: normalisation, projections, attention of {measured.heads} heads and a perceptron, "
            f"{measured.width} wide. Times are processor time of one thread."
        )
    return tuple(notes)


def _deviations(measured: TokenTimes | None, *, quick: bool, not_measured: str) -> tuple[str, ...]:
    notes = [
        "Eq. 5 bounds attention alone. Projections and perceptron cost the same per token however the tokens "
        "are split, so a whole layer saves less: both are shown.",
    ]
    if measured is None:
        return (*notes, f"Latency was not measured: {not_measured}.")
    notes.append(
        "The paper times the whole of Depth-Anything-V2; here one layer of a small vision transformer's size "
        "is timed on a processor, with weights drawn at random: time does not depend on them."
    )
    if quick:
        notes.append(f"Quick: {measured.tokens[-1]} tokens at most, fewer than a full run's.")
    return tuple(notes)


ATTENTION, LAYER, MODEL = "#0072B2", "#D55E00", "#333333"


def time_picture(measured: TokenTimes) -> StudyFigure:
    """Return the figure of time against tokens."""
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
    """Return the figure of Eq. 5 beside the measured times."""
    return StudyFigure(
        name="token-split",
        title="Cost of a backdrop and streams over that of all tokens at once",
        caption="At equal tokens attention costs what Eq. 5 predicts; a whole layer saves less, "
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
