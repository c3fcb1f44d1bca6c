"""Depth of all points by 1, 2 and 4 workers of a cluster on this machine, and the model of its time.

The processor time of every process is read, so that the terms of the model are measured separately.
"""

import os
import time
from collections.abc import Callable
from dataclasses import dataclass

from foveacam_bench.batch.dask_processes import DaskProcesses
from foveacam_bench.figures import Figures

WORKERS = {"four": 4, "two": 2, "one": 1}
"""Numbers of workers, in this order; the last worker stays."""
EXTRAPOLATED = 16, 64


@dataclass(frozen=True, slots=True, kw_only=True)
class Usage:
    """Time of some work, and the processor time of the processes involved, s."""

    took_s: float
    workers_cpu_s: float
    scheduler_cpu_s: float
    waiting_cpu_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ScalingModel:
    """The terms of a batch's time, s, for one product: a worker computes it and waits for its files.

    `scheduler_cpu_s`, `waiting_cpu_s`: time for one task of the scheduler, and of the process that waits.
    """

    cpu_s: float
    io_s: float
    scheduler_cpu_s: float
    waiting_cpu_s: float

    def time_s(self, products: int, *, workers: int, shared_cores: int | None = None) -> float:
        """Return the time of a batch; `shared_cores`: number for all processes, None: a core for each."""
        by_workers_s = (self.cpu_s + self.io_s) / workers
        all_s = self.cpu_s + self.scheduler_cpu_s + self.waiting_cpu_s
        limits_s = [all_s / shared_cores] if shared_cores else [self.scheduler_cpu_s, self.waiting_cpu_s]
        return products * max(by_workers_s, *limits_s)

    @property
    def most_workers(self) -> float:
        """Number of workers with a core each at which the scheduler or the waiting process saturates."""
        return (self.cpu_s + self.io_s) / max(self.scheduler_cpu_s, self.waiting_cpu_s)


def used_by(work: Callable[[], object], cluster: DaskProcesses) -> Usage:
    """Do work by the workers of a cluster; return its time, and the processor time of each process."""
    before, own_s, began_s = cluster.cpu_s(), time.process_time(), time.perf_counter()
    work()
    took_s, after = time.perf_counter() - began_s, cluster.cpu_s()
    return Usage(
        took_s=took_s,
        workers_cpu_s=sum(after.workers) - sum(before.workers),
        scheduler_cpu_s=after.scheduler - before.scheduler,
        waiting_cpu_s=time.process_time() - own_s,
    )


def scaling_figures(runs: dict[str, Usage], *, products: int, empty: Usage, empty_tasks: int) -> Figures:
    """Return the times of 4, 2 and 1 workers, beside those of the model, whose terms come from the last.

    `empty`: of tasks that do nothing. The model's rates of more workers, each with a core, are not measured.
    """
    one, cores = runs["one"], len(os.sched_getaffinity(0))
    cpu_s = one.workers_cpu_s / products
    model = ScalingModel(
        cpu_s=cpu_s,
        io_s=max(0.0, one.took_s / products - cpu_s),
        scheduler_cpu_s=empty.scheduler_cpu_s / empty_tasks,
        waiting_cpu_s=empty.waiting_cpu_s / empty_tasks,
    )
    figures: Figures = {"cpus": cores, "scaled_products": products}
    for word, count in WORKERS.items():
        run = runs[word]
        kind = "worker" if count == 1 else "workers"
        figures |= {
            f"{word}_{kind}_s": run.took_s,
            f"{word}_{kind}_cpu_s": run.workers_cpu_s,
            f"{word}_{kind}_scheduler_cpu_s": run.scheduler_cpu_s,
            f"{word}_{kind}_waiting_cpu_s": run.waiting_cpu_s,
        }
        if count > 1:  # the terms are those of one worker
            predicted_s = model.time_s(products, workers=count, shared_cores=cores)
            figures[f"{word}_{kind}_predicted_s"] = predicted_s
            figures[f"efficiency_{count}_workers"] = one.took_s / (count * run.took_s)
    for count in EXTRAPOLATED:
        figures[f"products_per_s_{count}_workers_own_cores"] = 1.0 / model.time_s(1, workers=count)
    return figures | {
        "product_cpu_ms": 1e3 * model.cpu_s,
        "product_io_ms": 1e3 * model.io_s,
        "scheduler_cpu_ms_per_task": 1e3 * model.scheduler_cpu_s,
        "waiting_cpu_ms_per_task": 1e3 * model.waiting_cpu_s,
        "scheduling_ms_per_task": 1e3 * empty.took_s / empty_tasks,
        "most_workers": model.most_workers,
    }
