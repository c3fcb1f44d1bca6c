"""The stand-off study for the report: comparison with the paper, definitions, deviations and figures."""

from collections.abc import Sequence
from dataclasses import dataclass

from foveacam_pipeline.study.report.findings import PaperComparison, StudyFigure, drawing_of
from foveacam_pipeline.study.visibility.checks import CELL_M, CHECKED_MAP, ProbabilityCheck, RasterCheck
from foveacam_pipeline.study.visibility.curves import (
    F64,
    AreaFit,
    StandoffCurves,
    area_figure,
    coverage_figure,
    curve_band,
    gap_figure,
    grows_at_every_step,
)
from foveacam_pipeline.study.visibility.formula_figures import checks_figure, near_figure, success_figure
from foveacam_pipeline.study.visibility.plan_figures import duality_figure, map_figure
from foveacam_pipeline.study.visibility.standoff import StandoffRing
from foveacam_pipeline.study.visibility.sweep import StandoffSweep, drawn_map

SHOWN_RATIO = 3.0
"""Ratio of D_max to D_min on the maps of Fig. 7."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StandoffFindings:
    """The results. `few`: of the maps of Figs. 9 and 10; `tight`: of all; `fits`: of multi and single.

    `signs`: relative change of the multi-fovea area by reading of Eq. 9 and ratio. `noticed`: share of that
    area within another target's D_min.
    """

    sweep: StandoffSweep
    few: StandoffCurves
    tight: StandoffCurves
    fits: tuple[AreaFit, AreaFit]
    redrawn: int
    checks: tuple[ProbabilityCheck, ...]
    raster: RasterCheck
    signs: dict[str, float]
    noticed: float
    quick: bool

    @property
    def outside(self) -> int:
        """The number of settings sampled more than 3 standard errors from the closed form."""
        return sum(abs(check.z) > 3.0 for check in self.checks)

    @staticmethod
    def gaps(curves: StandoffCurves) -> tuple[F64, F64, F64]:
        """Return per map: multi less single area, m²; coverage less that of any one and of a fixed target."""
        return (
            curves.multi_m2 - curves.single_m2,
            curves.multi - curves.single_any,
            curves.multi - curves.single_fixed,
        )


def comparison_rows(found: StandoffFindings) -> tuple[PaperComparison, ...]:
    """Return the paper's claims beside our results."""
    return (*_area_rows(found), *_coverage_rows(found), *_check_rows(found))


def _area_rows(found: StandoffFindings) -> tuple[PaperComparison, ...]:
    multi, single = found.fits
    few = found.few
    return (
        PaperComparison(
            quantity="mean feasible area over the ratio (Fig. 9)",
            paper="quadratic growth of both curves, 10 maps",
            ours=f"quadratic polynomial: R² {multi.r2:.5f} multi, {single.r2:.5f} single",
            note=f"a straight line: {multi.line_r2:.4f}, {single.line_r2:.4f}; k (x² − 1): "
            f"{multi.law_r2:.4f}, {single.law_r2:.4f}. The single curve follows the law; the union's curve "
            "is bent much less, since rings overlap",
        ),
        PaperComparison(
            quantity="multi-fovea area beside single-fovea area (Fig. 9)",
            paper="progressively larger",
            ours=f"{_ratios(few.multi_m2, few.single_m2, few.ratios)}",
            note="the gap of the means grows at every step"
            if grows_at_every_step(few.ratios, found.gaps(few)[0].mean(axis=0))
            else "the gap of the means does not grow at every step",
        ),
    )


def _coverage_rows(found: StandoffFindings) -> tuple[PaperComparison, ...]:
    few, tight = found.few, found.tight
    _, gap_any, gap_fixed = (curve_band(gap) for gap in found.gaps(tight))
    ratio = few.ratios[-1]
    return (
        PaperComparison(
            quantity=f"coverage of one loop at a ratio of {ratio:g} (Fig. 10)",
            paper="substantially higher with many foveae",
            ours=f"{few.multi[:, -1].mean():.2f} ± {few.multi[:, -1].std(ddof=1):.2f} multi, "
            f"{few.single_any[:, -1].mean():.2f} ± {few.single_any[:, -1].std(ddof=1):.2f} any one, "
            f"{few.single_fixed[:, -1].mean():.2f} ± {few.single_fixed[:, -1].std(ddof=1):.2f} fixed",
            note=f"± 1σ over {few.maps} maps",
        ),
        PaperComparison(
            quantity="gap of coverage with the ratio (Fig. 10)",
            paper="widens",
            ours=f"any one target: {_steps(gap_any.mean, few.ratios)}; fixed: "
            f"{_steps(gap_fixed.mean, few.ratios)}",
            note=f"{tight.maps} maps; half 95 % intervals of {gap_any.half_95.max():.3f} and "
            f"{gap_fixed.half_95.max():.3f} at most",
        ),
    )


def _check_rows(found: StandoffFindings) -> tuple[PaperComparison, ...]:
    raster = found.raster
    return (
        PaperComparison(
            quantity="Eqs. 10-13 beside Monte Carlo",
            paper="closed forms",
            ours=f"{found.outside} of {len(found.checks)} settings outside 3 standard errors, largest "
            f"{max(abs(check.z) for check in found.checks):.2f}",
            note=_outside_text(found),
        ),
        PaperComparison(
            quantity="exact regions beside a raster of cells",
            paper="not stated",
            ours=f"areas within {100.0 * raster.rel_diff:.3f} %, {raster.speedup:.0f} times as fast",
            note=f"{CHECKED_MAP.obstacle_count} obstacles, {CHECKED_MAP.target_count} targets, cells of "
            f"{100.0 * CELL_M:g} cm; CPU time {1e3 * raster.exact_s:.1f} ms beside "
            f"{1e3 * raster.raster_s:.0f} ms of numpy",
        ),
    )


def definitions(found: StandoffFindings) -> tuple[str, ...]:
    """Return the definitions of the terms on the plots."""
    sweep, layout = found.sweep, found.sweep.layout
    return (
        "Region of a target: the annulus between Dₘᵢₙ and Dₘₐₓ around it, without what obstacles hide from "
        "it and without points where the agent's disc meets an obstacle or the map's edge. Dₘᵢₙ is the "
        "bound in force: a depth error that counts is in it already (Eq. 9).",
        "Multi-fovea area: area of the union of the regions. Single-fovea area: mean over the targets of the "
        "area of each one's own region. Weighted area: the sum of the regions' areas, that is, area "
        "weighted by the number of targets in sight.",
        "Loop: the convex hull of the targets grown by Dₘᵢₙ and a margin, cut at the walls; groups of "
        "obstacles in its way are passed outside, or inside where they reach the walls. It is closed, free "
        "of collisions, and nowhere nearer than Dₘᵢₙ to a target. R = ∮ N dt over its normalised length "
        "(Eq. 14), computed from the lengths of its pieces in the regions.",
        "N: multi-fovea, targets observed at once; single-fovea, 0 or 1, read in two ways: any one target at "
        "a time, or one fixed target, mean over which.",
        f"Maps: {layout.size_m[0]:g} m by {layout.size_m[1]:g} m, {layout.target_count} targets at least "
        f"{layout.target_gap_m:g} m apart and {layout.edge_m:g} m from the edge, {layout.obstacle_count} "
        f"obstacles of {layout.corners[0]} to {layout.corners[1]} corners and radius {layout.radii_m[0]:g} "
        f"to {layout.radii_m[1]:g} m, agent of radius {layout.agent_radius_m:g} m, Dₘᵢₙ = {sweep.d_min_m:g} "
        f"m, margin of the loop {sweep.margin_m:g} m, ratios {sweep.ratios[0]:g} to {sweep.ratios[-1]:g}.",
        "Fits of Fig. 9: least squares of the mean areas over x = Dₘₐₓ / Dₘᵢₙ at fixed Dₘᵢₙ, with a "
        "polynomial of degree 2; R² is the share of the variance about the mean over x that is explained.",
        "Success: an observer uniform in the domain is in the ring with a clear line to the target, among "
        "obstacles whose centres are a Poisson process of the rate −ln(1 − p) per m². Slope by Monte "
        "Carlo (Eq. 13): the share of observers in a ring of 1 m about Dₘₐₓ.",
    )


def deviations(found: StandoffFindings) -> tuple[str, ...]:
    """Return what differs from the paper, and why."""
    notes = [
        "Eq. 9 as printed subtracts the depth error from Dₘᵢₙ; the text says that the error inflates the "
        "stealth bound. Both are implemented; used is Dₘᵢₙ + error, since an observer that must keep Dₘᵢₙ "
        "stays farther away by the error of its distance. On these maps, with the wide camera's error at "
        "Dₘᵢₙ for 1 px, "
        f"the multi-fovea area changes by {_changes_text(found.signs)}.",
        "The paper states neither size nor clutter of its maps, nor Dₘᵢₙ, nor the range of ratios: those "
        "above are ours.",
        "Targets are drawn near enough to each other that some loops see two at once from a ratio of 1.25 "
        "on. Were they all farther apart, a fovea free to turn to any one target would see as much as many "
        "foveae at small ratios: that gap would be 0 there.",
        "The paper does not say along which curve its agent goes around; the loop is defined above.",
        "A region keeps away from its own target only. Of the multi-fovea area at a ratio of "
        f"{SHOWN_RATIO:g}, {100.0 * found.noticed:.1f} % is nearer than Dₘᵢₙ to another target; the loop "
        "never is.",
        "Dₘₐₓ is exact, S / (2 tan(θ/2)); S / θ differs by θ²/12, less than 2e-7 for either camera here.",
        f"Random maps without a loop around their targets are drawn again: {found.redrawn} beside the "
        f"{found.tight.maps} that count.",
    ]
    if found.quick:
        notes.append(
            f"Quick: {found.tight.maps} maps instead of 1000 for the tight intervals, and "
            f"{found.checks[0].drawn.trials} trials a setting instead of 200000."
        )
    return tuple(notes)


def _ratios(multi_m2: F64, single_m2: F64, ratios: Sequence[float]) -> str:
    factor = multi_m2.mean(axis=0)[1:] / single_m2.mean(axis=0)[1:]
    return f"{factor[0]:.2f} times at a ratio of {ratios[1]:g}, {factor[-1]:.2f} times at {ratios[-1]:g}"


def _steps(gap: F64, ratios: Sequence[float]) -> str:
    shown = [n for n, ratio in enumerate(ratios) if ratio in (1.5, 2.0, 3.0, 4.0)]
    return ", ".join(f"{gap[n]:.3f} at {ratios[n]:g}" for n in shown)


def _outside_text(found: StandoffFindings) -> str:
    trials = f"{found.checks[0].drawn.trials} trials each"
    names = [f"Eq. {check.equation}, {check.setting}" for check in found.checks if abs(check.z) > 3.0]
    if not names:
        return trials
    return f"{trials}; outside: {'; '.join(names)}. One in 370 is expected by chance"


def _changes_text(signs: dict[str, float]) -> str:
    named = {"inflated": "Dₘᵢₙ + error", "as_printed": "Dₘᵢₙ − error"}
    parts = []
    for key, change in signs.items():
        bound, ratio = key.rsplit("_", 1)
        parts.append(f"{100.0 * change:+.2f} % at a ratio of {ratio} ({named[bound]})")
    return ", ".join(parts).replace("-", "−")


def pictures(
    found: StandoffFindings, seeds: Sequence[tuple[int, ...]], *, trials: int, seed: int
) -> tuple[StudyFigure, ...]:
    """Return every figure of the study; `seeds` are the maps', `seed` the study's."""
    return (
        *_plans(found, seeds[:4]),
        *_curves(found),
        *_formulas(found, trials=trials, seed=seed + 1),
    )


def _plans(found: StandoffFindings, seeds: Sequence[tuple[int, ...]]) -> tuple[StudyFigure, ...]:
    sweep = found.sweep
    shown = StandoffRing(inner_m=sweep.d_min_m, outer_m=SHOWN_RATIO * sweep.d_min_m)
    fields = [drawn_map(sweep, each)[0] for each in seeds]
    radius_m = sweep.layout.agent_radius_m
    return (
        StudyFigure(
            name="standoff-duality",
            title="Stealth and visibility around one target",
            caption="Nothing is left where the observer resolves no farther than it is noticed; beyond that "
            "an annulus; obstacles cut it into sectors of the same angles at every radius behind them.",
            drawing=drawing_of(duality_figure()),
            figure="Fig. 6",
        ),
        StudyFigure(
            name="standoff-map",
            title="Feasible regions of many targets among obstacles",
            caption=f"Random map of the seed {seeds[0]}, with Dₘᵢₙ = {shown.inner_m:g} m and Dₘₐₓ = "
            f"{shown.outer_m:g} m; an agent stands where the regions of two targets meet and none notices "
            "it, if they meet; further maps beside it.",
            drawing=drawing_of(map_figure(fields, shown, agent_radius_m=radius_m)),
            figure="Fig. 7",
        ),
    )


def _curves(found: StandoffFindings) -> tuple[StudyFigure, ...]:
    sweep, few, tight = found.sweep, found.few, found.tight
    multi, single = found.fits
    return (
        StudyFigure(
            name="standoff-area",
            title="Feasible area over the ratio of Dₘₐₓ to Dₘᵢₙ",
            caption=f"Dₘᵢₙ = {sweep.d_min_m:g} m. Quadratic polynomials fit both means (R² {multi.r2:.5f} "
            f"and {single.r2:.5f}). A straight line reaches {multi.line_r2:.4f} and {single.line_r2:.4f}, "
            f"the law of open rings k (x² − 1) {multi.law_r2:.4f} and {single.law_r2:.4f}: rings of "
            "neighbouring targets overlap, so that their union grows more slowly than each of them.",
            drawing=drawing_of(area_figure(few, tight, found.fits)),
            figure="Fig. 9",
        ),
        StudyFigure(
            name="standoff-coverage",
            title="Coverage of one loop around the targets",
            caption=f"Mean of {few.maps} maps and one standard deviation over them, for both readings of a "
            "single fovea: free to turn to any one target, or kept on one.",
            drawing=drawing_of(coverage_figure(few)),
            figure="Fig. 10",
        ),
        StudyFigure(
            name="standoff-gaps",
            title="What many foveae gain, over many maps",
            caption=f"Gaps between the means of Figs. 9 and 10 over {tight.maps} maps; bands are 95 % "
            "intervals.",
            drawing=drawing_of(gap_figure(tight)),
        ),
    )


def _formulas(found: StandoffFindings, *, trials: int, seed: int) -> tuple[StudyFigure, ...]:
    return (
        StudyFigure(
            name="standoff-lots",
            title="Closed forms beside Monte Carlo",
            caption=f"{found.outside} of {len(found.checks)} settings of Eqs. 10-13 are outside 3 standard "
            "errors of what random draws give.",
            drawing=drawing_of(checks_figure(found.checks)),
        ),
        StudyFigure(
            name="standoff-success",
            title="Probability of success among random obstacles",
            caption="P grows with Dₘₐₓ whatever the occupancy, ever more slowly where obstacles are dense.",
            drawing=drawing_of(success_figure(trials=trials, seed=seed)),
            figure="Eqs. 12, 13",
        ),
        StudyFigure(
            name="standoff-near",
            title="Depth error at the stealth bound",
            caption="The law of Sec. 4.1 at Dₘᵢₙ with Table 2's values, the ring that wide and fovea leave, "
            "and what either sign of Eq. 9 does to it.",
            drawing=drawing_of(near_figure()),
            figure="Eq. 9",
        ),
    )
