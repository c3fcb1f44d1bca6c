"""Tasks that are tried again: on worker processes that die, and on a pool whose parts end as a test says."""

import os
import time
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import ParamSpec, TypeVar

import pytest

from foveacam_hardware.contract import MonotonicClock, VirtualClock
from foveacam_pipeline.workers.cluster import cluster_workers
from foveacam_pipeline.workers.pool import Part, PartLost, WorkersLost, WorkPool
from foveacam_pipeline.workers.processes import local_workers
from foveacam_pipeline.workers.retries import LATE_S, TaskEnd, run_tasks

T = TypeVar("T")
P = ParamSpec("P")


class ScriptedPool:
    """Computes at once; loses, or leaves under way, the submissions whose tasks a script names."""

    most_under_way = 4

    def __init__(self, script: dict[int, list[str]]) -> None:
        self._script = script
        self.submitted: list[object] = []

    def submit(self, work: Callable[P, T], *arguments: P.args, **named: P.kwargs) -> Part[T]:
        """Compute the part, or do to it what the script says."""
        (task,) = arguments
        assert isinstance(task, int)
        self.submitted.append(task)
        fate = self._script.get(task, [])
        word = fate.pop(0) if fate else "done"
        part: Future[T] = Future()
        if word == "lost":
            part.set_exception(PartLost("a worker was ended"))
        elif word == "done":
            part.set_result(work(*arguments, **named))
        return part

    def result(self, part: Part[T]) -> T:
        """Return the result."""
        return part.result()


def ends(pool: WorkPool, work: Callable[[int], T], *, tasks: int = 8) -> list[TaskEnd[int, T]]:
    return list(run_tasks(pool, work, range(tasks), clock=VirtualClock(), stopped=lambda: False))


def negative(task: int) -> int:
    return -task


def test_a_task_that_was_lost_beside_another_is_no_less_tried_for_it() -> None:
    pool = ScriptedPool({1: ["lost"], 2: ["lost", "lost", "lost"]})
    found = {end.task: end.result for end in ends(pool, negative)}
    assert found == {task: -task for task in range(8)}
    assert pool.submitted.count(2) == 4


def test_a_task_that_is_lost_alone_three_times_is_given_up_and_the_others_are_not() -> None:
    found = {end.task: end for end in ends(ScriptedPool({2: ["lost"] * 9}), negative)}
    assert len(found) == 8
    assert found[2].result is None
    assert found[2].lost == "given up after 3 workers died: a worker was ended"
    assert found[7].result == -7


def test_a_late_task_holds_no_other_up_and_is_computed_once_more() -> None:
    pool = ScriptedPool({0: ["hangs"]})
    clock = VirtualClock()
    found = list(run_tasks(pool, negative, range(8), clock=clock, stopped=lambda: False))
    assert [end.task for end in found] == [1, 2, 3, 4, 5, 6, 7, 0]
    assert pool.submitted.count(0) == 2
    assert clock.now_ns() > 1e9 * LATE_S


def test_a_run_that_is_stopped_gives_out_nothing_more() -> None:
    pool, told = ScriptedPool({}), list[int]()
    for end in run_tasks(pool, negative, range(100), clock=VirtualClock(), stopped=lambda: len(told) > 0):
        told.append(end.task)
    assert len(told) <= ScriptedPool.most_under_way == len(pool.submitted)


def dying(task: int, *, mark: Path) -> int:
    """End the process in the first task, the first time."""
    if task == 0 and not mark.exists():
        mark.touch()
        os._exit(1)
    return -task


@pytest.mark.slow
def test_worker_processes_that_died_are_replaced(tmp_path: Path) -> None:
    work = partial(dying, mark=tmp_path / "died")
    with local_workers(2) as pool:
        found = run_tasks(pool, work, range(4), clock=MonotonicClock(), stopped=lambda: False)
        assert sorted(end.result or 0 for end in found) == [-3, -2, -1, 0]
    assert (tmp_path / "died").exists()


@pytest.mark.slow
def test_a_scheduler_that_goes_away_ends_the_run_with_its_address() -> None:
    from distributed import LocalCluster  # an extra, and slow to import

    with ExitStack() as stack:
        local = stack.enter_context(
            LocalCluster(  # type: ignore[no-untyped-call]  # Dask ships no types
                n_workers=1, processes=False, dashboard_address=":0", protocol="tcp"
            )
        )
        pool = stack.enter_context(cluster_workers(local.scheduler_address))
        run = run_tasks(pool, slowly, range(50), clock=MonotonicClock(), stopped=lambda: False)
        next(run)
        local.close()
        with pytest.raises(WorkersLost, match=r"the scheduler at tcp://.* is gone"):
            list(run)


def slowly(_task: int) -> None:
    time.sleep(0.1)
