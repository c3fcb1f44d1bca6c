"""Computes products of captures (mosaic, reference, export) in child processes, one of a kind at a time."""

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from foveacam_hardware.contract import Busy, Clock
from foveacam_pipeline.capture.dataset import Dataset
from foveacam_server.datasets.collection import DatasetCollection, StoredCapture, readable_dataset
from foveacam_server.foundation.child_process import run_child
from foveacam_server.foundation.child_work import ChildProgress
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.job_table import Job
from foveacam_server.foundation.jobs import JobContext, JobRunner
from foveacam_server.foundation.schema import JobDocument, RequestModel, ResponseModel

Run = Callable[[Sequence[str]], None]
"""Runs the child process with these arguments to its end and reports its progress."""
WAIT = "wait for it, or cancel its job"


class ProductRequest(RequestModel):
    """The stored request of a job: the capture, and the child process's request as JSON."""

    capture_id: str
    arguments: str


class Captures(Protocol):
    """Access to the captures whose products are computed."""

    @property
    def collection(self) -> DatasetCollection:
        """The captures on the disk."""
        ...

    def is_running(self, capture_id: str) -> bool:
        """Return whether a job for the capture runs or is queued."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class DerivedProductTools:
    """Services that the jobs need."""

    captures: Captures
    jobs: JobRunner
    events: EventLog
    clock: Clock


@dataclass(frozen=True, slots=True, kw_only=True)
class DerivedProduct:
    """A kind of product: its name, and the module that computes it in a child process.

    `make`: takes the capture, the request as JSON, as the process gets it, and a function that runs the
    process; returns the URL of the result.
    """

    noun: str
    process: str
    make: Callable[[StoredCapture, str, Run], str]


class DerivedProductEvent(ResponseModel):
    """Data of the events of a product."""

    capture_id: str


class DerivedProductJobs:
    """Queues and runs the jobs of one kind of product; knows the capture whose product is being computed."""

    def __init__(self, kind: DerivedProduct, tools: DerivedProductTools) -> None:
        self._kind, self._tools = kind, tools
        self._lock = threading.Lock()
        self._live: tuple[str, str] | None = None
        """Id of the capture whose product is being computed, and of the job."""
        tools.jobs.handle(kind.noun, self._work, parallel=True)

    def start(
        self,
        capture_id: str,
        request: RequestModel,
        *,
        check: Callable[[StoredCapture], object],
        idempotency_key: str | None,
    ) -> Job:
        """Queue a job; `check` raises when the product cannot be computed."""
        jobs = self._tools.jobs
        stored_request = ProductRequest(capture_id=capture_id, arguments=request.model_dump_json())
        if jobs.has_key(idempotency_key):
            return jobs.submit(self._kind.noun, stored_request, idempotency_key=idempotency_key)
        stored = self._tools.captures.collection.get(capture_id)
        check(stored)
        with self._lock:
            self._check_free()
            job = jobs.submit(self._kind.noun, stored_request, idempotency_key=idempotency_key)
            self._live = capture_id, job.id
        self.emit("begun", f"a {self._kind.noun} of capture {stored.name} was asked for", capture_id)
        return job

    def running_job(self, capture_id: str) -> JobDocument | None:
        """Return the job that computes the product of a capture now."""
        job = self._job_of(capture_id)
        return None if job is None else job.describe()

    def running_arguments(self, capture_id: str) -> str | None:
        """Return the request, as JSON, of the job that computes the product of a capture now."""
        job = self._job_of(capture_id)
        return None if job is None else job.parse_request(ProductRequest).arguments

    def ended_dataset(self, stored: StoredCapture) -> Dataset:
        """Return the dataset of a capture; raise InvalidInput for a damaged one, Busy for a running one."""
        dataset = readable_dataset(stored)
        if self._tools.captures.is_running(stored.id):
            noun = self._kind.noun
            raise Busy(
                f"the {noun} of {stored.name} was asked for: the capture is still running",
                asked=f"the {noun} of {stored.name}",
                found="it is still running",
                remedy="ask again when it has ended",
            )
        return dataset

    def check_idle(self, capture_id: str, asked: str) -> None:
        """Raise Busy while the product of this capture is being computed."""
        if self._job_of(capture_id) is not None:
            noun = self._kind.noun
            raise Busy(
                f"asked to {asked}: the {noun} of capture {capture_id} is being made",
                asked=asked,
                found=f"its {noun} is being made",
                remedy=WAIT,
            )

    def emit(self, what: str, message: str, capture_id: str) -> None:
        """Emit the event `<noun>.<what>`."""
        data = DerivedProductEvent(capture_id=capture_id)
        self._tools.events.emit(f"{self._kind.noun}.{what}", message, data=data)

    def _work(self, context: JobContext) -> str:
        request = context.job.parse_request(ProductRequest)
        stored = self._tools.captures.collection.get(request.capture_id)
        try:
            return self._kind.make(
                stored,
                request.arguments,
                lambda arguments: run_reporting(
                    self._kind.process, arguments, context=context, clock=self._tools.clock
                ),
            )
        finally:
            with self._lock:
                self._live = None
            self.emit("ended", f"the {self._kind.noun} of capture {stored.name} ended", stored.id)

    def _check_free(self) -> None:
        live = self._live
        if live is not None and not self._tools.jobs.get(live[1]).state.ended:
            found = f"the {self._kind.noun} of capture {live[0]} is being made"
            raise Busy(found=found, remedy=WAIT)

    def _job_of(self, capture_id: str) -> Job | None:
        live = self._live
        if live is None or live[0] != capture_id:
            return None
        job = self._tools.jobs.get(live[1])
        return None if job.state.ended else job


def run_reporting(module: str, arguments: Sequence[str], *, context: JobContext, clock: Clock) -> None:
    """Run a child process to its end and report its progress as the job's. Raise as `run_child`."""
    began_ns = clock.now_ns()

    def on_progress(step: ChildProgress) -> None:
        spent_s = (clock.now_ns() - began_ns) / 1e9
        left_s = spent_s * (1.0 / step.share - 1.0) if step.share else None
        context.progress(step.done, total=step.total, note=step.note, left_s=left_s)

    run_child(module, arguments, on_progress=on_progress, cancelled=context.cancelled)
