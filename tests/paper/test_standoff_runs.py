"""Sec. 4.4.3: runs over many maps, on one machine and on a cluster."""

from collections.abc import Callable, Iterator
from dataclasses import asdict
from itertools import pairwise

import pytest
from joblib.externals.loky import get_reusable_executor

from foveacam_hardware.contract import Cancelled, InvalidInput
from foveacam_pipeline.study.visibility.maps import RandomMap
from foveacam_pipeline.study.visibility.sweep import MapRun, StandoffSweep, drawn_map, run_map, run_maps

SWEEP = StandoffSweep(ratios=(0.5, 1.0, 1.5, 2.5))
SEEDS = tuple((6, index) for index in range(6))


@pytest.fixture(scope="module")
def alone() -> tuple[MapRun, ...]:
    return run_maps(SWEEP, seeds=SEEDS)


@pytest.fixture
def _processes_ended() -> Iterator[None]:
    yield
    get_reusable_executor().shutdown(wait=True)


class Impatient:
    """Has enough after the second report."""

    def __init__(self) -> None:
        self.reports: list[tuple[int, int, str]] = []

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        self.reports.append((done, total, note))

    def cancelled(self) -> bool:
        return len(self.reports) == 2


def test_up_to_the_ratio_of_one_nothing_is_seen_and_beyond_it_ever_more(alone: tuple[MapRun, ...]) -> None:
    for run in alone:
        nothing = [*map(asdict, run.areas[:2]), *map(asdict, run.coverage[:2])]
        assert not any(number for found in nothing for number in found.values())
        multi = [found.multi_m2 for found in run.areas[1:]]
        assert all(low < high for low, high in pairwise(multi))
        assert all(found.multi_m2 >= found.single_m2 for found in run.areas)
        for found in run.coverage:  # the lengths of pieces are summed: equal to rounding
            assert found.multi >= found.single_any - 1e-9
            assert found.single_any >= found.single_fixed - 1e-9


def test_a_map_run_repeats_itself_and_differs_from_the_next(alone: tuple[MapRun, ...]) -> None:
    assert run_map(SWEEP, SEEDS[1]) == alone[1]
    assert alone[0] != alone[1]


def test_maps_without_a_loop_are_drawn_again_and_counted() -> None:
    tight = StandoffSweep(layout=RandomMap(edge_m=4.0, obstacle_count=120))
    redrawn = [drawn_map(tight, (3, seed))[2] for seed in range(6)]
    assert max(redrawn) > 0
    with pytest.raises(InvalidInput, match="none of 20 random maps has a loop around its targets"):
        drawn_map(StandoffSweep(d_min_m=19.0), (3, 0))


@pytest.mark.usefixtures("_processes_ended")
def test_two_processes_find_what_one_does_and_are_ended_halfway(alone: tuple[MapRun, ...]) -> None:
    assert run_maps(SWEEP, seeds=SEEDS, n_jobs=2) == alone
    watch = Impatient()
    with pytest.raises(Cancelled, match="start it again"):
        run_maps(SWEEP, seeds=SEEDS, n_jobs=2, watch=watch)
    assert watch.reports == [(1, 6, "map 1 of 6"), (2, 6, "map 2 of 6")]


def test_a_cluster_of_two_workers_finds_what_one_process_does(alone: tuple[MapRun, ...]) -> None:
    from distributed import LocalCluster  # an extra, and slow to import

    with LocalCluster(  # type: ignore[no-untyped-call]  # Dask ships no types
        n_workers=2, threads_per_worker=1, processes=False, dashboard_address=":0", protocol="tcp"
    ) as cluster:
        assert len(cluster.scheduler.workers) == 2  # `scheduler_info` is its copy, and follows later
        assert run_maps(SWEEP, seeds=SEEDS, cluster=cluster.scheduler_address) == alone


@pytest.mark.parametrize(
    "ask",
    [
        lambda: StandoffSweep(ratios=()),
        lambda: StandoffSweep(ratios=(2.0, 1.0)),
        lambda: StandoffSweep(d_min_m=0.0),
    ],
)
def test_a_sweep_of_nothing_is_refused(ask: Callable[[], object]) -> None:
    with pytest.raises(InvalidInput, match=r"at least one"):
        ask()
