"""The stand-off study of Sec. 4.4: rings, random obstacles, maps with many targets.

Its values are computed here; `summary` has its comparison with the paper, its definitions and its figures.
"""

from collections.abc import Sequence

import numpy as np
import shapely

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.study.report.findings import StudyResult, Value
from foveacam_pipeline.study.tradeoff.depth_error import FOVEA_PX_PER_DEG, WIDE_PX_PER_DEG, error_m
from foveacam_pipeline.study.visibility.checks import closed_forms, raster_check
from foveacam_pipeline.study.visibility.curves import (
    F64,
    AreaFit,
    StandoffCurves,
    curve_band,
    curves_from_runs,
    fit_area,
    grows_at_every_step,
)
from foveacam_pipeline.study.visibility.formula_figures import (
    FEATURE_M,
    FEATURE_PX,
    NEAR_ERROR_PX,
    SHOWN_INNER_M,
    camera_ring,
)
from foveacam_pipeline.study.visibility.regions import disc, feasible_regions, region_areas
from foveacam_pipeline.study.visibility.standoff import (
    NearBound,
    StandoffRing,
    resolution_rad,
    resolving_range_m,
    standoff_ring,
)
from foveacam_pipeline.study.visibility.summary import (
    SHOWN_RATIO,
    StandoffFindings,
    comparison_rows,
    definitions,
    deviations,
    pictures,
)
from foveacam_pipeline.study.visibility.sweep import MapRun, StandoffSweep, drawn_map, run_maps
from foveacam_pipeline.workers.progress import SILENT, ProgressSteps, ProgressWatcher

SEED = 44
"""Default seed: the number of the section."""

TRIALS, QUICK_TRIALS = 200_000, 50_000
QUICK_MAPS = 100
NEAR_RATIOS = (1.25, 2.0)
"""Ratios at which the readings of Eq. 9 are compared on the maps."""

CHECKS_WEIGHT, PICTURES_WEIGHT = 15, 10
"""Share of checks and figures in the progress, counted in maps."""


def standoff_study(
    *,
    maps: int = 10,
    tight_maps: int = 1000,
    quick: bool = False,
    n_jobs: int = 1,
    cluster: str | None = None,
    seed: int = SEED,
    watch: ProgressWatcher = SILENT,
) -> StudyResult:
    """Return the study of Sec. 4.4.

    `maps`: random maps of Figs. 9 and 10; `tight_maps`: maps of the tight intervals, the former among them.
    `quick`: at most `QUICK_MAPS` of them, and fewer Monte Carlo trials. `n_jobs`, `cluster`: where maps are
    computed (`run_maps`); no value but CPU times depends on it. Raise InvalidInput, Cancelled,
    NotConnected.
    """
    if min(maps, tight_maps) < 2 or seed < 0:
        raise InvalidInput(
            f"{maps} and {tight_maps} maps with the seed {seed} were asked for; a deviation needs 2 maps or "
            "more, and a seed is 0 or more"
        )
    tight = max(maps, min(tight_maps, QUICK_MAPS) if quick else tight_maps)
    sweep = StandoffSweep()
    seeds = [(seed, n) for n in range(tight)]
    part = _PartialProgress(watch, 0, tight + CHECKS_WEIGHT + PICTURES_WEIGHT)
    runs = run_maps(sweep, seeds=seeds, n_jobs=n_jobs, cluster=cluster, watch=part)
    steps = ProgressSteps(
        _PartialProgress(watch, tight, part.total),
        0,
        ended="the study was cancelled; start it again to go on",
    )
    trials = QUICK_TRIALS if quick else TRIALS
    found = _findings(sweep, runs, seeds, maps=maps, trials=trials, seed=seed, quick=quick)
    steps.step("checks", CHECKS_WEIGHT)
    drawn = pictures(found, seeds, trials=trials, seed=seed)
    steps.step("pictures", PICTURES_WEIGHT)
    return StudyResult(
        name="standoff",
        section="4.4",
        title="Seeing without being seen: stand-off, obstacles, many targets",
        values=_values(found),
        rows=comparison_rows(found),
        pictures=drawn,
        definitions=definitions(found),
        deviations=deviations(found),
        seeds={"maps": seed, "lots": seed + 1, "cells": seed + 2},
    )


def _findings(
    sweep: StandoffSweep,
    runs: Sequence[MapRun],
    seeds: Sequence[tuple[int, ...]],
    *,
    maps: int,
    trials: int,
    seed: int,
    quick: bool,
) -> StandoffFindings:
    """Return the curves of the first `maps` runs and of all, with the checks of both."""
    few = curves_from_runs(sweep.ratios, runs[:maps])
    return StandoffFindings(
        sweep=sweep,
        few=few,
        tight=curves_from_runs(sweep.ratios, runs),
        fits=(_fit(few, few.multi_m2), _fit(few, few.single_m2)),
        redrawn=sum(run.redrawn for run in runs),
        checks=closed_forms(trials=trials, seed=seed + 1),
        raster=raster_check(seed + 2),
        signs=_eq9_changes(sweep, seeds[:maps]),
        noticed=_noticed_share(sweep, seeds[:maps]),
        quick=quick,
    )


class _PartialProgress:
    """Reports the progress of a part of the study to the watcher of the whole."""

    def __init__(self, watch: ProgressWatcher, before: int, total: int) -> None:
        self._watch, self._before, self.total = watch, before, total

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        del total  # of the part
        self._watch.progress(self._before + done, total=self.total, note=note)

    def cancelled(self) -> bool:
        return self._watch.cancelled()


def _fit(curves: StandoffCurves, figures: F64) -> AreaFit:
    return fit_area(curves.ratios, figures.mean(axis=0))


def _eq9_changes(sweep: StandoffSweep, seeds: Sequence[tuple[int, ...]]) -> dict[str, float]:
    """Return the change of the multi-fovea area by each sign of Eq. 9, with the wide camera's error."""
    error = error_m(sweep.d_min_m, WIDE_PX_PER_DEG, error_px=NEAR_ERROR_PX)
    fields = [drawn_map(sweep, seed)[0] for seed in seeds]
    found = {}
    for ratio in NEAR_RATIOS:
        total_m2 = {}
        for bound in NearBound:
            around = standoff_ring(sweep.d_min_m, ratio * sweep.d_min_m, near_error_m=error, bound=bound)
            total_m2[bound] = sum(
                region_areas(
                    feasible_regions(field, around, agent_radius_m=sweep.layout.agent_radius_m)
                ).multi_m2
                for field in fields
            )
        for bound in (NearBound.INFLATED, NearBound.AS_PRINTED):
            found[f"{bound}_{ratio:g}"] = total_m2[bound] / total_m2[NearBound.PLAIN] - 1.0
    return found


def _noticed_share(sweep: StandoffSweep, seeds: Sequence[tuple[int, ...]]) -> float:
    """Return the share of the multi-fovea area, at the ratio of Fig. 7, that is within another's D_min."""
    around = StandoffRing(inner_m=sweep.d_min_m, outer_m=SHOWN_RATIO * sweep.d_min_m)
    all_m2 = near_m2 = 0.0
    for seed in seeds:
        field = drawn_map(sweep, seed)[0]
        regions = feasible_regions(field, around, agent_radius_m=sweep.layout.agent_radius_m)
        union = shapely.union_all(list(regions))
        near = shapely.union_all([disc(at, sweep.d_min_m) for at in field.targets_m])
        all_m2, near_m2 = all_m2 + union.area, near_m2 + union.intersection(near).area
    return near_m2 / all_m2


def _values(found: StandoffFindings) -> dict[str, Value]:
    few, tight, raster = found.few, found.tight, found.raster
    gap_area, gap_any, gap_fixed = (gap.mean(axis=0) for gap in found.gaps(few))
    return {
        "mc_settings": len(found.checks),
        "mc_outside_3se": found.outside,
        "mc_largest_z": max(abs(check.z) for check in found.checks),
        "mc_trials": found.checks[0].drawn.trials,
        "raster_rel_diff": raster.rel_diff,
        "region_speedup": raster.speedup,
        "region_exact_ms": 1e3 * raster.exact_s,
        "region_raster_ms": 1e3 * raster.raster_s,
        "ratios": list(few.ratios),
        "maps": few.maps,
        "maps_tight": tight.maps,
        "maps_redrawn": found.redrawn,
        "fig9_r2_multi": found.fits[0].r2,
        "fig9_r2_single": found.fits[1].r2,
        **_fit_values("multi", found.fits[0]),
        **_fit_values("single", found.fits[1]),
        "fig9_r2_multi_tight": _fit(tight, tight.multi_m2).r2,
        "fig9_r2_single_tight": _fit(tight, tight.single_m2).r2,
        "fig9_multi_m2": _list(few.multi_m2.mean(axis=0)),
        "fig9_single_m2": _list(few.single_m2.mean(axis=0)),
        "fig9_weighted_m2": _list(few.weighted_m2.mean(axis=0)),
        "fig9_multi_never_below_single": bool((few.multi_m2 >= few.single_m2).all()),
        "fig9_gap_monotone": grows_at_every_step(few.ratios, gap_area),
        "fig9_noticed_by_another_share": found.noticed,
        **{f"fig10_{name}": _list(figures.mean(axis=0)) for name, figures in _rates(few).items()},
        **{f"fig10_{name}_sigma": _list(curve_band(figures).sigma) for name, figures in _rates(few).items()},
        "fig10_gap_any": _list(gap_any),
        "fig10_gap_fixed": _list(gap_fixed),
        "fig10_gap_monotone": grows_at_every_step(few.ratios, gap_any)
        and grows_at_every_step(few.ratios, gap_fixed),
        **_tight_values(found),
        **_bound_values(found),
    }


def _fit_values(name: str, fit: AreaFit) -> dict[str, Value]:
    return {
        f"fig9_quadratic_{name}_m2": list(fit.quadratic),
        f"fig9_law_{name}_m2": fit.law_m2,
        f"fig9_r2_law_{name}": fit.law_r2,
        f"fig9_r2_line_{name}": fit.line_r2,
    }


def _rates(curves: StandoffCurves) -> dict[str, F64]:
    return {
        "multi": curves.multi,
        "single_any": curves.single_any,
        "single_fixed": curves.single_fixed,
    }


def _tight_values(found: StandoffFindings) -> dict[str, Value]:
    values: dict[str, Value] = {}
    ratios = found.tight.ratios
    names = ("fig9_gap_m2", "fig10_gap_any", "fig10_gap_fixed")
    for name, gap in zip(names, found.gaps(found.tight), strict=True):
        over = curve_band(gap)
        values[f"{name}_tight"] = _list(over.mean)
        values[f"{name}_tight_half_95"] = _list(over.half_95)
        values[f"{name}_tight_monotone"] = grows_at_every_step(ratios, over.mean)
        beyond = np.asarray(ratios) > 1.0
        values[f"{name}_tight_above_0"] = bool((over.mean > over.half_95)[beyond].all())
    return values


def _bound_values(found: StandoffFindings) -> dict[str, Value]:
    values: dict[str, Value] = {}
    for name, px_per_deg in (("wide", WIDE_PX_PER_DEG), ("fovea", FOVEA_PX_PER_DEG)):
        at_m = SHOWN_INNER_M
        angle = resolution_rad(px_per_deg, pixels=FEATURE_PX)
        exact_m = resolving_range_m(FEATURE_M, angle)
        small_m = resolving_range_m(FEATURE_M, angle, small_angle=True)
        values[f"d_max_{name}_m"] = exact_m
        values[f"d_max_{name}_small_angle_rel_diff"] = small_m / exact_m - 1.0
        values[f"near_error_{name}_mm"] = 1e3 * error_m(at_m, px_per_deg, error_px=NEAR_ERROR_PX)
        values[f"ring_{name}_m2"] = camera_ring(px_per_deg, at_m).area_m2
    values |= {f"eq9_{name}_rel_change": change for name, change in found.signs.items()}
    return values


def _list(figures: F64) -> list[Value]:
    return [float(each) for each in figures]
