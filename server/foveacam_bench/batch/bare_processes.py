"""Baseline of two workers: the same products by independent processes, without a scheduler.

Two processes on two cores rarely do twice the work of one: cores share caches, memory and the disk, and those
of a virtual machine their host. The limit of a cluster is therefore measured in the same run.
"""

import multiprocessing
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

Make = Callable[[list[Path], Path], None]
"""Makes all products of datasets in a folder; a function that processes can import."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BareTimes:
    """Times of two processes and of one, s."""

    two_s: float
    one_s: float

    @property
    def efficiency(self) -> float:
        """Parallel efficiency: speed-up by two processes, over 2."""
        return self.one_s / (2.0 * self.two_s)


def bare_times(make: Make, datasets: list[Path], folder: Path) -> BareTimes:
    """Measure the time of two bare processes and of one."""
    two_s, one_s = (_took_s(make, datasets, folder, processes=count) for count in (2, 1))
    return BareTimes(two_s=two_s, one_s=one_s)


def _took_s(make: Make, datasets: list[Path], folder: Path, *, processes: int) -> float:
    """Return the time in which processes make equal shares, after they have loaded all code."""
    spawned = multiprocessing.get_context("spawn")
    name = f"bare-{processes}"
    with ExitStack() as stack:
        pools = [stack.enter_context(ProcessPoolExecutor(1, mp_context=spawned)) for _ in range(processes)]
        for number, pool in enumerate(pools):
            pool.submit(make, datasets[:1], folder / f"{name}-{number}-loaded").result()
        began_s = time.perf_counter()
        shares = [
            pool.submit(make, datasets[number::processes], folder / f"{name}-{number}")
            for number, pool in enumerate(pools)
        ]
        for share in shares:
            share.result()
        return time.perf_counter() - began_s
