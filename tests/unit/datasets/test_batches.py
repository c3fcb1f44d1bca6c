"""Batches: the same results from one process, from several, and from a cluster, one of whose workers dies."""

import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from importlib.metadata import version
from pathlib import Path
from typing import Any

import cv2
import pytest

from foveacam_hardware.contract import InvalidInput, NotConnected
from foveacam_pipeline.workers import cluster
from foveacam_pipeline.workers.cluster import check_workers, cluster_client, cluster_workers
from foveacam_pipeline.workers.pool import HereAndNow, WorkersLost, WorkPool, results_in_order
from foveacam_pipeline.workers.processes import local_workers

PARTS = [(number,) for number in range(12)]


def square(number: int, begun: str, processes: int) -> tuple[int, int]:
    """Return a square and by which process, once so many processes have begun."""
    Path(begun, str(os.getpid())).touch()
    while len(list(Path(begun).iterdir())) < processes:
        time.sleep(0.01)  # the machine may be too busy to start the others at once
    time.sleep(0.02 * (number % 3))  # the later ones are ready before the earlier
    return number * number, os.getpid()


def late(number: int) -> int:
    time.sleep(0.1)
    return number


def dying_once(number: int, mark: str) -> int:
    """End the worker of the third part, the first time."""
    if number == 2 and not Path(mark).exists():
        Path(mark).touch()
        os._exit(1)
    return -number


def opencv_threads(_number: int) -> int:
    return cv2.getNumThreads()


def dying(_number: int) -> int:
    os._exit(1)


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    from distributed import LocalCluster  # an extra, and slow to import

    with LocalCluster(  # type: ignore[no-untyped-call]  # Dask ships no types
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0"
    ) as local:
        yield local.scheduler_address


def enter(address: str) -> None:
    with cluster_client(address):
        raise AssertionError("it was opened")


def check_squares(pool: WorkPool, *, processes: int) -> None:
    with tempfile.TemporaryDirectory() as begun:
        found = list(results_in_order(pool, square, [(number, begun, processes) for (number,) in PARTS]))
    assert [value for value, _ in found] == [number * number for (number,) in PARTS]
    assert len({process for _, process in found}) == processes


def test_one_process_computes_a_part_only_when_its_turn_comes() -> None:
    check_squares(HereAndNow(), processes=1)
    begun: list[int] = []
    results = results_in_order(HereAndNow(), begun.append, PARTS)
    next(results)
    results.close()
    assert begun == [0]


@pytest.mark.slow
def test_two_processes_and_a_cluster_of_two_give_the_same_in_order(address: str) -> None:
    with local_workers(2) as pool:
        check_squares(pool, processes=2)
        assert list(results_in_order(pool, opencv_threads, PARTS)) == [1] * len(PARTS)
    with cluster_workers(address) as pool:
        assert pool.most_under_way == 6
        check_squares(pool, processes=2)
        assert list(results_in_order(pool, opencv_threads, PARTS)) == [1] * len(PARTS)


@pytest.mark.slow
def test_a_part_whose_worker_dies_is_computed_by_another(address: str, tmp_path: Path) -> None:
    mark = tmp_path / "died"
    with cluster_workers(address) as pool:
        parts = [(number, str(mark)) for number in range(6)]
        assert list(results_in_order(pool, dying_once, parts)) == [0, -1, -2, -3, -4, -5]
    assert mark.exists()


@pytest.mark.slow
def test_workers_that_die_for_good_are_told_of(address: str) -> None:
    with local_workers(2) as pool, pytest.raises(WorkersLost, match="ended from outside"):
        list(results_in_order(pool, dying, PARTS))
    with cluster_workers(address) as pool, pytest.raises(WorkersLost, match="again and again in one part"):
        list(results_in_order(pool, dying, PARTS[:1]))


@pytest.mark.slow
def test_a_scheduler_that_goes_away_is_told_of() -> None:
    from distributed import LocalCluster  # an extra, and slow to import

    with ExitStack() as stack:
        local = stack.enter_context(
            LocalCluster(  # type: ignore[no-untyped-call]  # Dask ships no types
                n_workers=1, processes=False, dashboard_address=":0", protocol="tcp"
            )
        )
        pool = stack.enter_context(cluster_workers(local.scheduler_address))
        results = results_in_order(pool, late, PARTS)
        assert next(results) == 0
        local.close()
        with pytest.raises(WorkersLost, match=r"the scheduler at tcp://.* is gone"):
            list(results)


def test_workers_of_another_version_or_without_a_module_are_refused_by_name() -> None:
    ours = version("foveacam-duo")
    check_workers({"tcp://a:1": (ours, [])}, ["torch"])
    with pytest.raises(InvalidInput, match=f"tcp://b:2 has another foveacam-duo .*: 0.0.1 instead of {ours}"):
        check_workers({"tcp://a:1": (ours, []), "tcp://b:2": ("0.0.1", [])}, [])
    with pytest.raises(InvalidInput, match="tcp://b:2 cannot import torch"):
        check_workers({"tcp://b:2": (ours, ["torch"])}, ["torch"])
    with pytest.raises(InvalidInput, match=r"none .*No module named"):
        check_workers({"tcp://b:2": ModuleNotFoundError("No module named 'foveacam_pipeline'")}, [])


def test_a_scheduler_without_workers_is_told_of(monkeypatch: pytest.MonkeyPatch) -> None:
    from distributed import LocalCluster  # an extra, and slow to import

    monkeypatch.setattr(cluster, "WORKER_S", 0.5)
    with LocalCluster(  # type: ignore[no-untyped-call]  # Dask ships no types
        n_workers=0, processes=False, dashboard_address=":0", protocol="tcp"
    ) as local:
        address = local.scheduler_address
        with pytest.raises(NotConnected, match=f"at {address} has no workers; start some with .dask worker"):
            enter(address)


def test_without_dask_the_remedy_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InvalidInput, match=r"pip install 'foveacam-duo\[cluster\]'"):
        enter("tcp://127.0.0.1:8786")


@pytest.mark.parametrize("address", ["here", "http://127.0.0.1:8786", "tcp://127.0.0.1", "tcp://a:b"])
def test_what_is_no_address_is_refused(address: str) -> None:
    with pytest.raises(InvalidInput, match="is no address of a Dask scheduler; start one"):
        enter(address)


def test_a_scheduler_that_does_not_answer_is_named() -> None:
    with pytest.raises(NotConnected, match=r"no Dask scheduler answers at tcp://127\.0\.0\.1:1; start one"):
        enter("tcp://127.0.0.1:1")


class _Waiting:
    """A part whose result is its number, and which says whether it was cancelled."""

    def __init__(self, number: int) -> None:
        self.number, self.cancelled = number, False

    def done(self) -> bool:
        return True

    def result(self) -> int:
        return self.number

    def cancel(self) -> None:
        self.cancelled = True


class _WaitingPool:
    most_under_way = 4

    def __init__(self) -> None:
        self.parts: list[_Waiting] = []

    def submit(self, work: Callable[..., Any], *arguments: Any, **_named: Any) -> Any:  # noqa: ANN401 - as WorkPool
        self.parts.append(_Waiting(arguments[0]))
        return self.parts[-1]

    def result(self, part: Any) -> Any:  # noqa: ANN401 - as WorkPool
        return part.result()


def test_parts_of_a_batch_that_is_left_early_are_cancelled() -> None:
    pool = _WaitingPool()
    results = results_in_order(pool, opencv_threads, PARTS)
    assert next(results) == 0
    results.close()
    assert [part.cancelled for part in pool.parts] == [False, True, True, True]
