"""One batch: planned products of datasets, computed by a pool of workers, and the outcome of each."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from foveacam_hardware.contract import Clock, FoveaError, InvalidInput
from foveacam_pipeline.capture.dataset.document import DOCUMENT
from foveacam_pipeline.capture.mosaic.depth_files import MeshFile
from foveacam_pipeline.learn.pair_folder import is_pair_folder
from foveacam_pipeline.products.making import ProductOutcome, make_product
from foveacam_pipeline.products.results import ProductFolder
from foveacam_pipeline.products.task import ProductSettings, ProductTask, plan_products
from foveacam_pipeline.workers.pool import WorkPool
from foveacam_pipeline.workers.progress import ProgressWatcher
from foveacam_pipeline.workers.retries import run_tasks


@dataclass(frozen=True, slots=True, kw_only=True)
class BatchFailure:
    """A product that could not be made, or a whole dataset (`unit` None), and why."""

    dataset: str
    unit: int | None
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class BatchPlan:
    """The products of a batch, and the datasets that have none."""

    settings: ProductSettings
    tasks: tuple[ProductTask, ...]
    refused: tuple[BatchFailure, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class BatchCounts:
    """Result of a run of a batch."""

    made: int
    reused: int
    failures: tuple[BatchFailure, ...]


def datasets_in(path: Path) -> tuple[Path, ...]:
    """Return the dataset or pairs at a path, or those directly below it, by name; raise InvalidInput."""
    if _is_source(path) or not path.is_dir():
        return (path,)
    found = tuple(sorted(folder for folder in path.iterdir() if _is_source(folder)))
    if not found:
        raise InvalidInput(
            f"{path} holds no dataset, nor does a folder in it",
            found="no dataset",
            remedy=f"give folders with a {DOCUMENT}",
        )
    return found


def plan_batch(folders: Sequence[Path], settings: ProductSettings) -> BatchPlan:
    """Return the products of datasets; raise InvalidInput for one given twice, or when all are refused."""
    resolved = [folder.resolve() for folder in folders]
    twice = sorted({folder for folder in resolved if resolved.count(folder) > 1})
    if twice:
        raise InvalidInput(f"{twice[0]} is given twice; give each dataset once", asked=str(twice[0]))
    tasks: list[ProductTask] = []
    refused: list[tuple[BatchFailure, FoveaError]] = []
    for folder in resolved:
        try:
            tasks.extend(plan_products(folder, settings))
        except FoveaError as error:
            refused.append((BatchFailure(dataset=folder.name, unit=None, reason=str(error)), error))
    if not tasks:
        raise refused[0][1]
    return BatchPlan(settings=settings, tasks=tuple(tasks), refused=tuple(refusal for refusal, _ in refused))


def run_batch(
    plan: BatchPlan,
    pool: WorkPool,
    into: ProductFolder,
    *,
    mesh_file: MeshFile,
    watch: ProgressWatcher,
    clock: Clock,
) -> BatchCounts:
    """Make the missing products until `watch` cancels. Raise WorkersLost, StorageFull."""
    made = reused = 0
    failures = list(plan.refused)
    work = partial(make_product, into=into, mesh_file=mesh_file)
    ends = run_tasks(pool, work, plan.tasks, clock=clock, stopped=watch.cancelled)
    for done, end in enumerate(ends, 1):
        outcome = end.result or ProductOutcome(failed=end.lost)
        if outcome.failed:
            failures.append(BatchFailure(dataset=end.task.name, unit=end.task.unit, reason=outcome.failed))
        made += not outcome.failed and not outcome.reused
        reused += outcome.reused
        watch.progress(done, total=len(plan.tasks), note=_note(reused, len(failures)))
    return BatchCounts(made=made, reused=reused, failures=tuple(failures))


def _is_source(folder: Path) -> bool:
    return (folder / DOCUMENT).is_file() or is_pair_folder(folder)


def _note(reused: int, failed: int) -> str:
    parts = [f"{count} {word}" for count, word in ((reused, "reused"), (failed, "failed")) if count]
    return ", ".join(parts)
