"""`foveacam bench batch`: products of simulated rasters by one process, processes, and a Dask cluster.

`cluster_equal_bytes_KIND`: whether this process, two processes and two workers of a cluster write the same.
`efficiency_N_workers`: time of one worker, which has one thread, over N times that of N. `lost_tasks`,
`double_results`: over all runs in which a worker was killed at a random moment. `overhead_ratio`: time of
tasks that sleep 1 s over the time that they sleep, less 1. `worker_growth_kib_per_1000`: slope of a worker's
resident memory over small tasks. `scheduling_ms_per_task`: of tasks that do nothing; `plan_and_summary_s`: of
all datasets. `bare_efficiency_2_processes`: the same of processes without a scheduler, the limit of this
machine. The model of the times, and its terms, are those of `scaling.py`.
"""

import random
import threading
import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np

from foveacam_bench.batch.bare_processes import bare_times
from foveacam_bench.batch.dask_processes import DaskProcesses
from foveacam_bench.batch.scaling import WORKERS, Usage, scaling_figures, used_by
from foveacam_bench.capture.mosaic import CERTIFICATE, SCENE, capture_raster, glb_of, plan_of
from foveacam_bench.figures import Figures, Report
from foveacam_hardware.contract import MonotonicClock, Role
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.capture.dataset import CapturedPoint, Dataset, DatasetHeader, DatasetWriter, Shot
from foveacam_pipeline.models import load_calibration
from foveacam_pipeline.networks.known_pair import known_pair
from foveacam_pipeline.products.batch import BatchPlan, plan_batch, run_batch
from foveacam_pipeline.products.results import ProductFolder
from foveacam_pipeline.products.summary import write_summary
from foveacam_pipeline.products.task import ProductKind, ProductSettings
from foveacam_pipeline.stereo.match import match
from foveacam_pipeline.workers.cluster import cluster_workers
from foveacam_pipeline.workers.pool import HereAndNow, WorkPool
from foveacam_pipeline.workers.processes import local_workers
from foveacam_pipeline.workers.progress import SILENT
from foveacam_pipeline.workers.retries import run_tasks

SIDE = 2
SEED = 4
SMALL_PX = 96, 64
WARM_UP_SHARE = 0.2
"""Share of the small tasks after which memory is expected to be flat."""
PAGE_KIB = 4
DEPTH = ProductSettings(kind=ProductKind.DEPTH)
EXPORT = ProductSettings(kind=ProductKind.EXPORT, to="nerfstudio", scale=0.5)
KINDS = (
    DEPTH,
    ProductSettings(kind=ProductKind.MOSAIC),
    EXPORT,
    ProductSettings(kind=ProductKind.EVALUATE),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Extent:
    """How much is measured. `datasets` of 2 x 2 points; `sleepers`: workers that sleep `naps` times."""

    datasets: int
    runs: int
    sleepers: int
    naps: int
    small_tasks: int


WHOLE = Extent(datasets=8, runs=20, sleepers=16, naps=1000, small_tasks=1000)
QUICK = Extent(datasets=2, runs=1, sleepers=2, naps=6, small_tasks=100)


def run(*, quick: bool = False, report: Report) -> Figures:
    """Measure and return the figures; `report` is told how far it is."""
    extent = QUICK if quick else WHOLE
    with TemporaryDirectory(prefix="foveacam-batch-") as name:
        folder = Path(name)
        report("capturing")
        datasets = simulated_rasters(folder / "datasets", count=extent.datasets)
        with DaskProcesses(folder, workers=2) as cluster:
            report("equal bytes")
            figures = equal_bytes(datasets[0], folder, cluster.address)
            report("killed workers")
            figures |= killed_workers(datasets, folder, cluster, runs=extent.runs)
            report("scaling")
            figures |= scaling(datasets, folder, cluster, empty_tasks=extent.small_tasks)
            report("memory")
            figures |= memory_growth(cluster.address, tasks=extent.small_tasks)
            report("overhead")
            cluster.resize(extent.sleepers)
            figures |= overhead(cluster.address, workers=extent.sleepers, tasks=extent.naps)
    return figures


def simulated_rasters(folder: Path, *, count: int) -> list[Path]:
    """Return datasets of 2 x 2 points; all but the first are copies of it with other ids."""
    folder.mkdir()
    calibration = load_calibration(CERTIFICATE)
    with open_simulated(SCENE, inline=True) as rig:
        capture_raster(rig, calibration, folder / "raster-0", plan_of(SIDE, calibration))
    first = Dataset.open(folder / "raster-0")
    for number in range(1, count):
        header = DatasetHeader(points=len(first), calibration=calibration)
        with DatasetWriter.create(folder / f"raster-{number}", header) as writer:
            for point in first:
                frames = [point.frame(role) for role in Role]
                shots = tuple(Shot(frame=frame) for frame in frames)
                writer.add(CapturedPoint(place=point.place, shots=shots))
            writer.finish()
    return sorted(folder.iterdir())


def equal_bytes(dataset: Path, folder: Path, cluster: str) -> Figures:
    """Return for each kind whether its bytes are the same wherever it is made."""
    figures: Figures = {}
    for settings in KINDS:
        plan, kind = plan_batch([dataset], settings), settings.kind.value
        make(plan, HereAndNow(), folder / "here")
        with local_workers(2) as pool:
            make(plan, pool, folder / "processes")
        with cluster_workers(cluster) as pool:
            make(plan, pool, folder / "cluster")
        here, *others = (contents(folder / place / kind) for place in ("here", "processes", "cluster"))
        figures[f"cluster_equal_bytes_{kind}"] = bool(here) and all(other == here for other in others)
    return figures


def killed_workers(datasets: list[Path], folder: Path, cluster: DaskProcesses, *, runs: int) -> Figures:
    """Return how many products were lost or duplicated when a worker was killed, over all runs."""
    plan, rng = plan_batch(datasets, DEPTH), random.Random(SEED)  # noqa: S311 - moments, not secrets
    whole_s = depth_usage(datasets, folder / "undisturbed", cluster).took_s
    expected = contents(folder / "undisturbed" / "depth")
    lost = double = unlike = 0
    for number in range(runs):
        into = ProductFolder(path=folder / f"killed-{number}")
        killer = threading.Timer(rng.random() * whole_s, cluster.kill_worker, (rng.randrange(2),))
        killer.start()
        with cluster_workers(cluster.address) as pool:
            make(plan, pool, into.path)
        killer.join()
        into.remove_unfinished()
        lost += sum(into.find(task) is None for task in plan.tasks)
        double += len(list((into.path / "depth").iterdir())) - len(plan.tasks)
        unlike += contents(into.path / "depth") != expected
    return {"killed_runs": runs, "lost_tasks": lost, "double_results": double, "unlike_results": unlike}


def scaling(datasets: list[Path], folder: Path, cluster: DaskProcesses, *, empty_tasks: int) -> Figures:
    """Return the time of 4, 2 and 1 workers for depth of all points, and the terms of the model."""
    runs: dict[str, Usage] = {}
    for word, workers in WORKERS.items():
        cluster.resize(workers)
        runs[word] = depth_usage(datasets, folder / word, cluster)
    with cluster_workers(cluster.address) as pool:
        tasks = partial(run_tasks, pool, nothing, clock=MonotonicClock(), stopped=lambda: False)
        empty = used_by(lambda: list(tasks(range(empty_tasks))), cluster)
    began_s = time.perf_counter()
    plan = plan_batch(datasets, DEPTH)
    write_summary(plan, ProductFolder(path=folder / "one"), ())
    figures = scaling_figures(runs, products=len(plan.tasks), empty=empty, empty_tasks=empty_tasks)
    figures["plan_and_summary_s"] = time.perf_counter() - began_s
    bare = bare_times(make_depth_here, datasets, folder)
    return figures | {
        "two_bare_processes_s": bare.two_s,
        "one_bare_process_s": bare.one_s,
        "bare_efficiency_2_processes": bare.efficiency,
        "efficiency_2_workers_of_bare": runs["one"].took_s / (2.0 * runs["two"].took_s) / bare.efficiency,
    }


def depth_usage(datasets: list[Path], out: Path, cluster: DaskProcesses) -> Usage:
    """Return the time for depth of all points by a cluster's workers, after they have loaded all code."""
    with cluster_workers(cluster.address) as pool:
        make(plan_batch(datasets[: pool.most_under_way], DEPTH), pool, out.with_name(f"{out.name}-loaded"))
        plan = plan_batch(datasets, DEPTH)
        return used_by(lambda: make(plan, pool, out), cluster)


def overhead(cluster: str, *, workers: int, tasks: int) -> Figures:
    """Return the overhead of tasks of 1 s: their time over the time that they sleep, less 1."""
    with cluster_workers(cluster) as pool:
        list(run_tasks(pool, nap, range(workers), clock=MonotonicClock(), stopped=lambda: False))
        began_s = time.perf_counter()
        list(run_tasks(pool, nap, range(tasks), clock=MonotonicClock(), stopped=lambda: False))
        took_s = time.perf_counter() - began_s
    slept_s = float(-(-tasks // workers))
    return {"naps": tasks, "nap_workers": workers, "naps_s": took_s, "overhead_ratio": took_s / slept_s - 1.0}


def memory_growth(cluster: str, *, tasks: int) -> Figures:
    """Return the slope of a worker's resident memory over small tasks, without those at the start."""
    with cluster_workers(cluster) as pool:
        ends = run_tasks(pool, match_small, range(tasks), clock=MonotonicClock(), stopped=lambda: False)
        held_kib = [end.result for end in ends if end.result is not None]
    warm = held_kib[round(WARM_UP_SHARE * tasks) :]
    slope = float(np.polyfit(np.arange(len(warm)), warm, 1)[0])
    return {"worker_growth_kib_per_1000": 1000.0 * slope, "worker_mib": warm[-1] / 1024}


def nap(_number: int) -> None:
    """Sleep 1 s."""
    time.sleep(1.0)


def nothing(_number: int) -> None:
    """Do nothing."""


def match_small(_number: int) -> int:
    """Match a small pair; return what this process holds in memory, KiB."""
    match(known_pair(*SMALL_PX).pair)
    return PAGE_KIB * int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])


def make(plan: BatchPlan, pool: WorkPool, out: Path) -> None:
    """Make a batch."""
    into = ProductFolder(path=out)
    run_batch(plan, pool, into, mesh_file=glb_of, watch=SILENT, clock=MonotonicClock())


def make_depth_here(datasets: list[Path], out: Path) -> None:
    """Make depth of all points in this process, by one thread."""
    cv2.setNumThreads(1)
    make(plan_batch(datasets, DEPTH), HereAndNow(), out)


def contents(folder: Path) -> dict[str, bytes]:
    """Return the content of all files below a folder, by their names."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
