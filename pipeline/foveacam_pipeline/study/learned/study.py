"""The study of Sec. 5: Table 3 with errors against the truth beside the photometric error, and Fig. 12."""

import csv
import io

from foveacam_pipeline.study.learned.figures import errors_picture, pairs_picture
from foveacam_pipeline.study.learned.outcomes import SHIFT_PX, LearnedOutcome, Method
from foveacam_pipeline.study.learned.ranking import MEASURES, Rows, gap, in_deviations, misranked, spread
from foveacam_pipeline.study.report.findings import PaperComparison, StudyResult, StudyTable, Value

PAPER: dict[Method, tuple[str, str]] = {
    Method.MONO: ("0.0410", "Mono-Fovea (aligned)"),
    Method.UNSIGNED: ("0.0415", "Fine Tuned IGEV"),
    Method.FULL_PRIOR: ("0.0856", "Ours (full strength prior loss)"),
    Method.NO_PRIOR: ("0.0480", "Ours (no prior loss)"),
    Method.ANNEALED: ("0.0354", "Ours"),
}
"""Table 3: the mean photometric error, and the name of the row."""
OWN = (Method.NO_PRIOR, Method.ANNEALED)
FORMS = {"epe_px": ".2f", "bad_1": ".3f", "abs_rel": ".3f", "answered": ".3f", "within_1_sigma": ".3f"}
WORDS = {
    "photometric_seen": "seen by both eyes",
    "l1": "L1 alone",
    "epe_px": "EPE, px",
    "bad_1": "above 1 px",
    "abs_rel": "AbsRel of depth",
    "within_1_sigma": "within 1 sigma",
}


def learned_study(outcome: LearnedOutcome, *, seed: int = 0, quick: bool = False) -> StudyResult:
    """Return the study of Sec. 5. `quick`: of one seed and few steps, which the result states."""
    return StudyResult(
        name="learned",
        section="5",
        title="Learned stereo without truth: Table 3 and Fig. 12",
        values=_values(outcome),
        rows=(*_rows(outcome.rows), *_order_rows(outcome.rows)),
        pictures=(errors_picture(outcome.rows), pairs_picture(outcome)),
        definitions=_definitions(outcome),
        deviations=_deviations(outcome, quick=quick),
        seeds={"first of the trainings": seed},
        tables=(StudyTable(name="methods", title="All figures of every seed", csv=_csv(outcome.rows)),),
    )


def _values(outcome: LearnedOutcome) -> dict[str, Value]:
    budget, rows = outcome.budget, outcome.rows
    return {
        "pairs": budget.pairs,
        "held_out": budget.held_out,
        "steps": budget.steps,
        "batch": budget.batch,
        "trained_seeds": budget.seeds,
        "trained_cpu_s": outcome.trained_cpu_s,
        "methods": {method.name.lower(): _method_values(rows, method) for method in rows},
        **_order_values(rows),
        "photometric_misranks": [f"{one} before {other}" for one, other in misranked(rows)],
    }


def _method_values(rows: Rows, method: Method) -> dict[str, Value]:
    found: dict[str, Value] = {}
    for key, measure in MEASURES.items():
        value = spread(rows[method], measure)
        found[key] = None if value is None else value.mean
        many = value is not None and len(rows[method]) > 1
        found[f"{key}_sd"] = value.deviation if many and value is not None else None
    return found


def _order_values(rows: Rows) -> dict[str, Value]:
    """Return whether the paper's order is reproduced, by its measure and by the truth, and by how much."""
    values: dict[str, Value] = {}
    for suffix, key in (("", "photometric"), ("_epe", "epe_px")):
        gaps = {method: gap(rows[Method.FULL_PRIOR], rows[method], MEASURES[key]) for method in OWN}
        least = min(gaps.values(), key=lambda found: found.mean)
        unsigned = gap(rows[Method.UNSIGNED], rows[Method.ANNEALED], MEASURES[key])
        values |= {
            f"order_full_prior_worst{suffix}": least.mean > 0.0,
            f"order_full_prior_worst{suffix}_gap_sd": in_deviations(least),
            f"order_unsigned_worse{suffix}": unsigned.mean > 0.0,
            f"order_unsigned_worse{suffix}_gap_sd": in_deviations(unsigned),
        }
    return values


def _rows(rows: Rows) -> tuple[PaperComparison, ...]:
    return tuple(_row(rows, method) for method in rows)


def _row(rows: Rows, method: Method) -> PaperComparison:
    photometric = spread(rows[method], MEASURES["photometric"])
    paper, name = PAPER.get(method, ("not in it", ""))
    beside = [
        f"{words} {found.text(FORMS.get(key, '.4f'))}"
        for key, words in WORDS.items()
        if (found := spread(rows[method], MEASURES[key])) is not None
    ]
    answered = spread(rows[method], MEASURES["answered"])
    if answered is not None and answered.mean < 0.999:
        beside.append(f"answered {answered.mean:.3f}, and evaluated there alone")
    return PaperComparison(
        quantity=f"photometric error, {method}",
        paper=f"{paper} ({name})" if name else paper,
        ours="" if photometric is None else photometric.text(".4f"),
        note="; ".join(beside),
    )


def _order_rows(rows: Rows) -> tuple[PaperComparison, ...]:
    values = _order_values(rows)
    claims = (
        ("full-strength prior is worse than either of ours", "yes: 0.0856", "order_full_prior_worst"),
        ("the unsigned volume is worse than ours", "yes: 0.0415 against 0.0354", "order_unsigned_worse"),
    )
    return tuple(
        PaperComparison(
            quantity=what,
            paper=paper,
            ours=_order_text(values, key),
            note=f"by end-point error: {_order_text(values, f'{key}_epe')}",
        )
        for what, paper, key in claims
    )


def _order_text(values: dict[str, Value], key: str) -> str:
    gap_sd = values[f"{key}_gap_sd"]
    verdict = "yes" if values[key] else "no"
    return f"{verdict}, by {abs(gap_sd):.1f} standard deviations" if isinstance(gap_sd, float) else verdict


def _definitions(outcome: LearnedOutcome) -> tuple[str, ...]:
    budget = outcome.budget
    width, height = budget.crop_px
    return (
        "Photometric error: 0.85 (1 - SSIM) / 2 + 0.15 L1 between the left picture and the right one "
        "warped by the disparity, over all pixels of both windows. EPE, above 1 px, AbsRel and the share "
        "within one stated sigma (0.757 would be right for a network, 0.683 for matching) are against the "
        "truth, where both eyes see the surface; an edge of depth within a pixel is left out.",
        f"Every network is nano, trained without truth by the same losses: {budget.steps} steps of "
        f"{budget.batch} crops of {width} x {height} px, from {budget.pairs} pairs; evaluated on "
        f"{budget.held_out} pairs of other scenes and textures. Mean ± one standard deviation of a seed.",
        "Unsigned: the correlation, and every refinement, admit no disparity below zero. Shift adapter: it "
        f"is trained and evaluated with right pictures moved by {SHIFT_PX} px, which is subtracted again.",
        "Monocular prior: a network of 0.7 million weights, trained by truth on the same pairs for "
        f"{budget.prior_steps} steps. Alone, its scale and shift are fitted for each pair to matches on "
        "which left and right agree, and on the second line to the truth, the best that they can be. As a "
        "loss, they are fitted to the prediction.",
        "A gap in standard deviations: difference of the means over the root of the mean of both variances.",
    )


def _deviations(outcome: LearnedOutcome, *, quick: bool) -> tuple[str, ...]:
    rows = outcome.rows
    notes = [
        "The paper's pictures, its weights and Depth-Anything-V2 are not here: pairs are rendered, halved to "
        "180 x 135 px, and the prior is a small network, trained with truth on the same kind of scenes. The "
        "paper states no formula of its error; its values are of the size of our L1 alone.",
        "IGEV is not fine-tuned: an unsigned version of our own network replaces it. So the row measures the "
        "effect of the sign, not the quality of IGEV's weights.",
        "Attention reconstruction is an addition to Eq. 15, for all networks alike.",
        *_misranking(rows),
        *_geometry(rows),
    ]
    if quick:
        notes.append("Quick: one seed and so few steps that no order of networks can be read from it.")
    return tuple(notes)


def _misranking(rows: Rows) -> list[str]:
    found = misranked(rows)
    if not found:
        return ["The photometric error ranks all methods without holes as the end-point error does."]
    named = "; ".join(f"{one} before {other}" for one, other in found)
    true = gap(rows[Method.MATCHING_FILLED], rows[Method.TRUTH], MEASURES["photometric"]).mean
    beats = "below" if true < 0.0 else "above"
    return [
        "The photometric error ranks disparities wrongly, compared with the truth: " + named + ".",
        f"That of filled matching lies {beats} that of the truth itself, by {abs(true):.4f}: occlusion "
        "and noise keep that of the truth from zero.",
    ]


def _geometry(rows: Rows) -> list[str]:
    found = gap(rows[Method.ANNEALED], rows[Method.GEOMETRY], MEASURES["epe_px"])
    gained = in_deviations(found)
    size = "" if gained is None else f", {abs(gained):.1f} standard deviations"
    clear = gained is not None and abs(gained) > 2.0
    return [
        f"With the viewing geometry as input, the network's EPE is {abs(found.mean):.2f} px "
        f"{'smaller' if found.mean > 0.0 else 'larger'}{size}"
        + ("." if clear else ": not significant in these runs.")
    ]


def _csv(rows: Rows) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["method", "run", *MEASURES])
    for method, found in rows.items():
        for number, row in enumerate(found):
            values = [measure(row) for measure in MEASURES.values()]
            writer.writerow([method.name.lower(), number, *("" if v is None else f"{v:.6g}" for v in values)])
    return text.getvalue()
