"""Areas and coverage of many random maps over ratios of D_max to D_min, in processes or on a Dask cluster.

Every map is drawn from its own seed, so that results do not depend on where or in what order they are
computed.
"""

from collections.abc import Generator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, field

import joblib
import shapely

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.study.visibility.coverage import LoopCoverage, closed_path, coverage
from foveacam_pipeline.study.visibility.maps import FieldMap, RandomMap, random_map
from foveacam_pipeline.study.visibility.regions import (
    RegionAreas,
    feasible_regions,
    region_areas,
    regions_within,
)
from foveacam_pipeline.study.visibility.standoff import StandoffRing
from foveacam_pipeline.workers.cluster import cluster_client
from foveacam_pipeline.workers.progress import SILENT, ProgressSteps, ProgressWatcher

REDRAWS = 20
"""Maps drawn for one seed, where no loop leads around the targets, before an error is raised."""

BATCH = 20
"""Maps that one worker computes at a time, at most."""

PARTS = 8
"""Least number of batches, where there are enough maps, so that every worker has some."""

AHEAD = 2
"""Batches for each worker between two checks for cancellation."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StandoffSweep:
    """Settings of a sweep: at each of `ratios`, D_max is that multiple of `d_min_m`.

    `margin_m`: clearance of the loop beyond D_min (`closed_path`).
    """

    ratios: tuple[float, ...] = tuple(1.0 + step / 4.0 for step in range(13))
    d_min_m: float = 2.0
    margin_m: float = 0.1
    layout: RandomMap = field(default_factory=RandomMap)

    def __post_init__(self) -> None:
        """Refuse ratios that do not ascend or exceed 0, and a sweep without targets."""
        if not self.ratios or not all(
            low < high for low, high in zip(self.ratios, self.ratios[1:], strict=False)
        ):
            raise InvalidInput(f"ratios of {self.ratios} were given; they are at least one, and ascend")
        if not self.ratios[0] > 0.0 or not self.d_min_m > 0.0 or self.layout.target_count < 1:
            raise InvalidInput("a sweep needs ratios and a D_min above 0, and at least one target")


@dataclass(frozen=True, slots=True, kw_only=True)
class MapRun:
    """One map: areas and coverage at each ratio; `redrawn`: number of maps without a loop drawn before it."""

    areas: tuple[RegionAreas, ...]
    coverage: tuple[LoopCoverage, ...]
    redrawn: int


def drawn_map(sweep: StandoffSweep, seed: tuple[int, ...]) -> tuple[FieldMap, shapely.LinearRing, int]:
    """Return a map of that seed, the loop around its targets, and the number of maps drawn before it."""
    radius_m = sweep.layout.agent_radius_m
    for redrawn in range(REDRAWS):
        found = random_map(sweep.layout, seed=(*seed, redrawn))
        try:
            path = closed_path(found, inner_m=sweep.d_min_m, agent_radius_m=radius_m, margin_m=sweep.margin_m)
        except InvalidInput:
            continue
        return found, path, redrawn
    raise InvalidInput(
        f"none of {REDRAWS} random maps has a loop around its targets {sweep.d_min_m:g} m away from each; "
        "ask for fewer obstacles, a smaller D_min, or more room between targets and edge"
    )


def run_map(sweep: StandoffSweep, seed: tuple[int, ...]) -> MapRun:
    """Return the results of one map at every ratio."""
    drawn, path, redrawn = drawn_map(sweep, seed)
    widest = StandoffRing(inner_m=sweep.d_min_m, outer_m=sweep.d_min_m * sweep.ratios[-1])
    regions = feasible_regions(drawn, widest, agent_radius_m=sweep.layout.agent_radius_m)
    found_areas, found_coverage = [], []
    for ratio in sweep.ratios:
        within = regions_within(drawn, regions, outer_m=ratio * sweep.d_min_m) if ratio > 1.0 else ()
        if not within:
            found_areas.append(RegionAreas(multi_m2=0.0, single_m2=0.0, weighted_m2=0.0))
            found_coverage.append(LoopCoverage(multi=0.0, single_any=0.0, single_fixed=0.0))
            continue
        union = shapely.union_all(list(within))
        found_areas.append(region_areas(within, union=union))
        found_coverage.append(coverage(path, within, union=union))
    return MapRun(areas=tuple(found_areas), coverage=tuple(found_coverage), redrawn=redrawn)


def run_maps(
    sweep: StandoffSweep,
    *,
    seeds: Sequence[tuple[int, ...]],
    n_jobs: int = 1,
    cluster: str | None = None,
    watch: ProgressWatcher = SILENT,
) -> tuple[MapRun, ...]:
    """Return one run for each seed, in their order, the same wherever they are computed.

    `n_jobs`: processes of this machine (joblib's count: -1 for all cores). `cluster`: the address of a Dask
    scheduler instead, with the extra `cluster`. Raise Cancelled, InvalidInput for an address without the
    extra, NotConnected where no scheduler answers, or one without workers.
    """
    steps = ProgressSteps(
        watch, len(seeds), ended="the study was cancelled; nothing of it is kept, start it again to go on"
    )
    found: list[MapRun] = []
    with _workers(cluster), closing(_results(sweep, seeds, -1 if cluster else n_jobs)) as results:
        for runs in results:
            found.extend(runs)
            steps.step(f"map {len(found)} of {len(seeds)}", len(runs))
    return tuple(found)


def _results(
    sweep: StandoffSweep, seeds: Sequence[tuple[int, ...]], n_jobs: int
) -> Generator[list[MapRun], None, None]:
    if n_jobs == 1:
        for seed in seeds:
            yield [run_map(sweep, seed)]
        return
    size = min(BATCH, -(-len(seeds) // PARTS))
    batches = [seeds[start : start + size] for start in range(0, len(seeds), size)]
    with joblib.Parallel(n_jobs=n_jobs) as workers:
        # in portions, so that it can be cancelled between them
        at_once = AHEAD * max(1, joblib.effective_n_jobs(n_jobs))
        for start in range(0, len(batches), at_once):
            tasks = [joblib.delayed(_run_batch)(sweep, batch) for batch in batches[start : start + at_once]]
            yield from workers(tasks)


def _run_batch(sweep: StandoffSweep, seeds: Sequence[tuple[int, ...]]) -> list[MapRun]:
    return [run_map(sweep, seed) for seed in seeds]


@contextmanager
def _workers(cluster: str | None) -> Generator[None, None, None]:
    """Send joblib's work to a Dask cluster, if one is given, within the context."""
    if cluster is None:
        yield
        return
    with cluster_client(cluster) as client, joblib.parallel_config("dask", client=client):
        yield
