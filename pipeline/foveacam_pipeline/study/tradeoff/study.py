"""The study of Sec. 4.2: whether a quarter of the pixels is better spent on far depths.

It always uses seeded streets, and frames of Virtual KITTI 2 and images of the rig where they are given.
"""

import math
from collections.abc import Iterable, Sequence
from itertools import chain
from pathlib import Path

import numpy as np

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.study.report.findings import PaperComparison, StudyFigure, StudyResult, Value
from foveacam_pipeline.study.tradeoff.depth_metrics import DepthMetric
from foveacam_pipeline.study.tradeoff.figures import bins_picture, patches_picture, ratio_picture
from foveacam_pipeline.study.tradeoff.outcomes import DisparityEstimator, SemiGlobal
from foveacam_pipeline.study.tradeoff.patches import PatchChoice
from foveacam_pipeline.study.tradeoff.rig_pairs import RigOutcome, RigPairScene, rig_outcome
from foveacam_pipeline.study.tradeoff.streets import FARTHEST_M, StereoScene, street
from foveacam_pipeline.study.tradeoff.sweep import (
    HEADLINE_SHARE,
    PATCHES,
    BudgetSweep,
    sweep_budgets,
    sweep_rows,
    sweep_values,
)
from foveacam_pipeline.study.tradeoff.vkitti import load_vkitti, vkitti_frames
from foveacam_pipeline.workers.progress import SILENT, ProgressSteps, ProgressWatcher

SHARES = (0.04, 0.0625, 0.09, 0.11, 0.16, 0.25, 0.36, 0.5)
QUICK_SHARES = (0.0625, 0.11, HEADLINE_SHARE)
SCENES = 80
QUICK_SCENES = 6
SEED_STRIDE = 1000
"""Seeds of streets reserved for each seed of the study, so that no two studies share a street."""
STREETS, VKITTI = "seeded streets", "Virtual KITTI 2"


def tradeoff_study(
    *,
    scenes: int = SCENES,
    quick: bool = False,
    vkitti: Path | None = None,
    estimator: DisparityEstimator | None = None,
    rig_pairs: Sequence[RigPairScene] = (),
    seed: int = 0,
    watch: ProgressWatcher = SILENT,
) -> StudyResult:
    """Return the study of Sec. 4.2.

    `scenes`: number of streets, and largest number of frames of Virtual KITTI 2 in the folder `vkitti`.
    `quick`: fewer of both and fewer budgets, which the result states. Raise InvalidInput, and Cancelled when
    the watcher asks.
    """
    if not 1 <= scenes <= SEED_STRIDE:
        raise InvalidInput(f"{scenes} scenes were asked for; 1 to {SEED_STRIDE} are possible")
    if seed < 0:
        raise InvalidInput(f"a seed of {seed} was given; 0 or more is possible")
    stereo = SemiGlobal() if estimator is None else estimator
    count, shares = (min(scenes, QUICK_SCENES), QUICK_SHARES) if quick else (scenes, SHARES)
    frames = () if vkitti is None else vkitti_frames(vkitti, count=count)
    steps = ProgressSteps(
        watch,
        (count + len(frames)) * len(shares) + len(rig_pairs),
        ended="the trade-off study was cancelled; none of it was kept, start it again",
    )
    first = street(SEED_STRIDE * seed)
    others = (street(SEED_STRIDE * seed + index) for index in range(1, count))

    def swept(given: Iterable[StereoScene]) -> BudgetSweep:
        return sweep_budgets(given, shares=shares, estimator=stereo, steps=steps)

    found = {STREETS: swept(chain([first], others))}
    if frames:
        found[VKITTI] = swept(load_vkitti(frame) for frame in frames)
    rigs = []
    for pair in rig_pairs:
        rigs.append(rig_outcome(pair, stereo))
        steps.step(pair.wide.name)
    return tradeoff_result(found, first, tuple(rigs), name=stereo.name, seed=seed, quick=quick)


def tradeoff_result(
    found: dict[str, BudgetSweep],
    first: StereoScene,
    rigs: Sequence[RigOutcome],
    *,
    name: str,
    seed: int,
    quick: bool,
) -> StudyResult:
    """Return the study of the sweeps by source and the outcomes of the rig. `first`: the street shown."""
    values: dict[str, Value] = {"estimator": name}
    rows: list[PaperComparison] = []
    pictures: list[StudyFigure] = []
    for source, each in found.items():
        short = "" if source == STREETS else "vkitti_"
        values |= sweep_values(each, prefix=short)
        rows += sweep_rows(each, source=source, seed=seed)
        pictures += [
            bins_picture(each, source=source, prefix=short),
            ratio_picture(each, source=source, prefix=short),
        ]
    pictures.append(patches_picture(found[STREETS], first))
    values |= _rig_values(rigs)
    return StudyResult(
        name="tradeoff",
        section="4.2",
        title="Depth-dependent trade-off under equal bandwidth",
        values=values,
        rows=(*rows, *_rig_rows(rigs)),
        pictures=tuple(pictures),
        definitions=_definitions(found[STREETS]),
        deviations=_deviations(found, rigs, name=name, quick=quick),
        seeds={"streets": seed},
    )


def _rig_values(rigs: Sequence[RigOutcome]) -> dict[str, Value]:
    if not rigs:
        return {"rig_pairs": 0}
    seen = [each for each in rigs if math.isfinite(each.inside_mr_absrel)]
    return {
        "rig_pairs": len(rigs),
        "rig_inside_share": [each.inside_share for each in rigs],
        "rig_inside_mr_absrel": [each.inside_mr_absrel for each in seen],
        "rig_inside_fov_absrel": [each.inside_fov_absrel for each in seen],
    }


def _rig_rows(rigs: Sequence[RigOutcome]) -> tuple[PaperComparison, ...]:
    return tuple(
        PaperComparison(
            quantity=f"AbsRel where the foveae look, simulated rig, view {number}",
            paper="not stated",
            ours=f"{each.inside_mr_absrel:.5f} by the wide pair, {each.inside_fov_absrel:.5f} by foveae",
            note=f"{100.0 * each.inside_share:.1f} % of the wide pixels; {each.pixels[0]} px "
            f"against {each.pixels[1]}",
        )
        for number, each in enumerate(rigs, start=1)
    )


def _definitions(streets: BudgetSweep) -> tuple[str, ...]:
    return (
        "q: share of the native pixels that either configuration spends. MR: both images reduced evenly to q."
        f" FOV: a backdrop of 0.75 q, and {PATCHES} patches at native resolution with 0.25 q together.",
        "Patches by truth: each covers the largest sum of true Z² that is left. By the estimate: the same, "
        "of the depth that the backdrop's own disparities give. Inside a patch its disparities replace the "
        "backdrop's; the right patch is shifted, and searched, as the backdrop's disparities say.",
        "Bins: tenths of the judged pixels by increasing true depth. Judged: with a true depth of "
        f"{FARTHEST_M:.0f} m at most, and seen by both eyes. Holes are filled from the background, and every "
        "judged pixel counts in both configurations.",
        "Gain: FOV − MR of a bin's score, its sign flipped for AbsRel and RMSE, mean over scenes. "
        "T, means: mean gain of improved bins over mean loss of degraded bins. T, sums: sum over sum.",
        f"Native: {streets.native.width} x {streets.native.height} px. Intervals: 90 %, scenes drawn anew "
        "with replacement.",
    )


def _deviations(
    found: dict[str, BudgetSweep], rigs: Sequence[RigOutcome], *, name: str, quick: bool
) -> tuple[str, ...]:
    scenes = len(found[STREETS].at(HEADLINE_SHARE, PatchChoice.TRUTH).outcomes)
    notes = [
        f"The paper runs FoundationStereo on Virtual KITTI 2; here {name} runs on {scenes} seeded streets of "
        "the same camera" + (", and on frames of the data set." if VKITTI in found else ".")
    ]
    if VKITTI not in found:
        notes.append(
            "Virtual KITTI 2 was not given: its licence forbids to bundle it; name the folder it lies in to "
            "have the same figures for it."
        )
    notes.append(
        "The paper states neither its budget, nor how many patches it places and by what, nor T's definition "
        "(its supplement): T is given in two readings, for two ways of placing, over a range of budgets."
    )
    point = found[STREETS].at(HEADLINE_SHARE, PatchChoice.TRUTH)
    gain, total = point.gains(DepthMetric.ABSREL), point.ratio(DepthMetric.ABSREL).total
    outweigh = "outweigh" if total > 1.0 else "do not outweigh"
    notes.append(
        f"By AbsRel {np.count_nonzero(gain > 0.0)} of {len(gain)} bins gain and "
        f"{np.count_nonzero(gain < 0.0)} lose at q = {point.share:g}: in sums far gains {outweigh} near "
        "losses. How much of the far bins the patches cover decides it."
    )
    if not rigs:
        notes.append("No images of the rig were given.")
    else:
        notes.append(
            "The rig's backdrop is a wide pair of the foveae's baseline: the wide camera moved to either "
            "side, as on the linear stage of Fig. 4. One wide camera alone has no depth."
        )
    if quick:
        notes.append(f"Quick: {scenes} streets and three budgets; intervals are wide.")
    return tuple(notes)
