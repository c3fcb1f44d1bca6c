"""Runs a batch in its folder, for the command and for the job; a run resumes where the last one ended."""

from collections.abc import Generator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

from foveacam_hardware.contract import MonotonicClock
from foveacam_pipeline.capture.dataset.lock import FolderLock
from foveacam_pipeline.products.batch import BatchCounts, BatchPlan, plan_batch, run_batch
from foveacam_pipeline.products.results import ProductFolder
from foveacam_pipeline.products.summary import BatchSummary, write_summary
from foveacam_pipeline.products.task import ProductSettings
from foveacam_pipeline.stereo.values import DepthMesh
from foveacam_pipeline.storage.disk import disk_errors
from foveacam_pipeline.workers.cluster import cluster_workers
from foveacam_pipeline.workers.pool import WorkersLost, WorkPool
from foveacam_pipeline.workers.processes import local_workers
from foveacam_pipeline.workers.progress import ProgressWatcher
from foveacam_web.glb import write_glb


@dataclass(frozen=True, slots=True, kw_only=True)
class BatchOrder:
    """Datasets, settings and folder of a batch; `cluster`: a Dask scheduler instead of `jobs` processes."""

    datasets: tuple[Path, ...]
    settings: ProductSettings
    out: Path
    jobs: int = 1
    cluster: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class BatchResult:
    """Counts of a run, and the state of the batch on the disk."""

    counts: BatchCounts
    summary: BatchSummary

    def document(self) -> dict[str, object]:  # object: JSON for the command line and the files
        """Return the run as JSON."""
        summary = self.summary
        return {
            "complete": summary.complete,
            "planned": summary.planned,
            "done": summary.done,
            "made": self.counts.made,
            "reused": self.counts.reused,
            "failed": [asdict(failure) for failure in self.counts.failures],
            "datasets": [
                {"name": one.name, "planned": one.planned, "done": one.done, **one.figures}
                for one in summary.datasets
            ],
            "files": [str(path) for path in summary.paths],
        }


def make_batch(order: BatchOrder, *, watch: ProgressWatcher) -> BatchResult:
    """Make the missing products of a batch, and write its summary.

    Raise InvalidInput, NotConnected, Busy, StorageFull; WorkersLost after the summary was written.
    """
    plan = plan_batch(order.datasets, order.settings)
    into = ProductFolder(path=order.out)
    with _only_writer(into):
        into.remove_unfinished()
        try:
            counts = _run(order, plan, into, watch)
        except WorkersLost as error:
            summary = write_summary(plan, into, plan.refused)
            raise type(error)(
                f"{error.statement}; {summary.done} of {summary.planned} products are in {order.out}",
                found=error.found,
                remedy=error.remedy,
            ) from error
        into.remove_unfinished()
        summary = write_summary(plan, into, counts.failures)
    return BatchResult(counts=counts, summary=summary)


def glb_of(mesh: DepthMesh) -> bytes:
    """Return a mesh as GLB, +y up as other programs expect."""
    return write_glb(mesh, y_up=True)


def _run(order: BatchOrder, plan: BatchPlan, into: ProductFolder, watch: ProgressWatcher) -> BatchCounts:
    with _workers(order) as pool:
        return run_batch(plan, pool, into, mesh_file=glb_of, watch=watch, clock=MonotonicClock())


def _workers(order: BatchOrder) -> AbstractContextManager[WorkPool]:
    if order.cluster is None:
        return local_workers(order.jobs)
    return cluster_workers(order.cluster, modules=("foveacam_web",))


@contextmanager
def _only_writer(into: ProductFolder) -> Generator[None, None, None]:
    """Lock the folder of a batch; raise Busy while another run writes there."""
    with disk_errors("the products", into.path.parent):
        into.path.mkdir(parents=True, exist_ok=True)
        lock = FolderLock(into.path, what="the batch folder")
    try:
        yield
    finally:
        lock.release()
