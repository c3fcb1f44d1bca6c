"""The pictures of the stand-off study (Figs. 6, 7, 9, 10 and what checks them), each with its caption."""

from collections.abc import Sequence

from foveacam_pipeline.study.findings import StudyFigure, drawing_of
from foveacam_pipeline.study.standoff import StandoffRing
from foveacam_pipeline.study.standoff_curves import area_figure, coverage_figure, gap_figure
from foveacam_pipeline.study.standoff_drawings import duality_figure, map_figure
from foveacam_pipeline.study.standoff_formulas import checks_figure, near_figure, success_figure
from foveacam_pipeline.study.standoff_runs import drawn_map
from foveacam_pipeline.study.standoff_words import SHOWN_RATIO, StandoffFindings


def pictures(
    found: StandoffFindings, seeds: Sequence[tuple[int, ...]], *, trials: int, seed: int
) -> tuple[StudyFigure, ...]:
    """Return every picture of the study; `seeds` are the maps', `seed` the study's."""
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
