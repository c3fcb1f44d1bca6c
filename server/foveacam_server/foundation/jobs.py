"""Runs jobs one after the other on one thread, as they share one rig; they can be cancelled at every step.

Jobs that do not move the rig may run in parallel, each on a thread of its own.
"""

import asyncio
import logging
import queue
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from contextvars import copy_context
from functools import partial

from foveacam_hardware.contract import Busy, Cancelled, Clock, FoveaError, InvalidInput, Stopped
from foveacam_hardware.contract.spans import note_span, span
from foveacam_server.foundation.errors import problem_of
from foveacam_server.foundation.events import EventLevel, EventLog
from foveacam_server.foundation.job_table import Job, JobState, JobTable
from foveacam_server.foundation.names import new_id, utc_now
from foveacam_server.foundation.schema import RequestModel
from foveacam_server.foundation.store import Store
from foveacam_server.foundation.watching.flows import count_flow, this_part
from foveacam_server.foundation.watching.work_ids import JOB_ID, REQUEST_ID

_log = logging.getLogger(__name__)

WAITING = 16
"""Jobs that may wait; further ones are refused."""


class JobContext:
    """What a running job gets: it reports progress and asks whether it was cancelled."""

    def __init__(self, runner: "JobRunner", job: Job, *, clock: Clock) -> None:
        self._runner = runner
        self._clock = clock
        self._began_ns = clock.now_ns()
        self._done_before: int | None = 0
        self.job = job

    def cancelled(self) -> bool:
        """Return whether the job was cancelled."""
        return self._runner.is_cancelled(self.job.id)

    def check(self) -> None:
        """Raise `Cancelled` when the job was cancelled."""
        if self.cancelled():
            raise Cancelled("the job was cancelled")

    def stage(self) -> None:
        """Start another part of the work: what its first report counts as done was done before."""
        self._done_before = None

    def progress(self, done: int, *, total: int, note: str = "", left_s: float | None = None) -> None:
        """Report `done` of `total`; the time left is extrapolated unless `left_s` is given."""
        job = self.job
        if self._done_before is None or (job.total and total != job.total):  # something else is counted now
            self._began_ns, self._done_before = self._clock.now_ns(), done
        job.done, job.total, job.note = done, total, note
        spent_s = (self._clock.now_ns() - self._began_ns) / 1e9
        here = done - self._done_before
        if left_s is None and here > 0 and total:
            left_s = spent_s / here * (total - done)
        job.eta_s = None if left_s is None else round(left_s, 2)
        self._runner.report(job)


Handler = Callable[[JobContext], str]
"""Runs a job and returns the URL of its result."""


class JobRunner:
    """One worker thread over the job table."""

    def __init__(self, store: Store, *, events: EventLog, clock: Clock) -> None:
        self._table = JobTable(store)
        self._events = events
        self._clock = clock
        self._handlers: dict[str, Handler] = {}
        self._parallel: set[str] = set()
        self._threads: set[threading.Thread] = set()
        self._waiting: queue.Queue[Callable[[], None] | None] = queue.Queue()
        self._lock = threading.Lock()
        self._open: dict[str, Job] = {}
        self._unsaved: dict[str, Job] = {}
        """Jobs that ended and could not be written to the disk."""
        self._cancelled: dict[str, str] = {}
        self._endings: dict[str, Future[Job]] = {}
        self.interrupted = self._table.end_interrupted()
        self._thread = threading.Thread(target=self._run, name="foveacam-jobs", daemon=True)

    def handle(self, kind: str, handler: Handler, *, parallel: bool = False) -> None:
        """Register the handler of the jobs of `kind`; before `start`.

        `parallel`: they wait for no other job, no job waits for them, and the stop does not cancel them. One
        that moves the rig (following) gives way to other jobs and ends by itself with the stop.
        """
        self._handlers[kind] = handler
        if parallel:
            self._parallel.add(kind)

    def start(self) -> None:
        """Start the worker thread."""
        self._thread.start()

    def begin_close(self) -> None:
        """Cancel all jobs, without waiting and without the database."""
        with self._lock:
            for job in self._open.values():
                self._mark_cancelled(job, "the server is shutting down")

    def close(self) -> None:
        """Cancel all jobs and end the threads."""
        self.begin_close()
        with self._lock:
            threads = list(self._threads)
        self._waiting.put(None)
        for thread in (self._thread, *threads):
            if thread.is_alive():
                thread.join(timeout=15.0)
        self._save_ended()

    def submit(
        self,
        kind: str,
        request: RequestModel | None = None,
        *,
        idempotency_key: str | None = None,
        total: int = 0,
        note: str = "",
    ) -> Job:
        """Enqueue a job, or return the earlier one with the same idempotency key.

        `request`: None for a kind that needs none. `total` and `note`: its progress before it reports any.
        """
        if kind not in self._handlers:
            raise InvalidInput(f"there is no kind of job called {kind}")
        with self._lock:
            waiting = sum(job.state is JobState.QUEUED for job in self._open.values())
        if waiting >= WAITING:
            raise Busy(
                f"{WAITING} jobs are waiting already; wait, or cancel some",
                found=f"{WAITING} jobs waiting",
                remedy="wait, or cancel some",
            )
        job = Job(
            id=new_id("job"),
            kind=kind,
            request={} if request is None else request.as_json(),
            idempotency_key=idempotency_key,
            total=total,
            note=note,
        )
        kept = self._table.add(job)
        if kept is not job:
            return self.get(kept.id)
        with self._lock:
            self._open[job.id] = job
            self._endings[job.id] = Future()
        self._emit(job)
        _log.info("job %s (%s) was asked for by request %s", job.id, kind, REQUEST_ID.get() or "of nobody")
        context = copy_context()  # with ids and trace of the request
        work = partial(context.run, self._do, job, time.perf_counter())
        count_flow(this_part(), f"foveacam-{kind if kind in self._parallel else 'jobs'}", "jobs")
        if kind in self._parallel:
            self._run_in_parallel(kind, work)
        else:
            self._waiting.put(work)
        return job

    def has_key(self, idempotency_key: str | None) -> bool:
        """Return whether an earlier job has this key, so that `submit` would return that one."""
        return idempotency_key is not None and self._table.has_key(idempotency_key)

    def get(self, job_id: str) -> Job:
        """Return a job in its present state or raise `NotFound`."""
        with self._lock:
            job = self._open.get(job_id) or self._unsaved.get(job_id)
        return job or self._table.get(job_id)

    def newest(self, limit: int) -> list[Job]:
        """Return the newest jobs, newest first."""
        with self._lock:
            live = {**self._unsaved, **self._open}
        return [live.get(job.id, job) for job in self._table.newest(limit)]

    @property
    def open_jobs(self) -> int:
        """Number of jobs that wait or run."""
        with self._lock:
            return len(self._open)

    async def ended(self, job_id: str, *, timeout_s: float) -> Job:
        """Wait for a job to end, at most `timeout_s`; return it in its state then."""
        with self._lock:
            ending = self._endings.get(job_id)
        if ending is not None:
            await asyncio.wait([asyncio.wrap_future(ending)], timeout=timeout_s)
        return self.get(job_id)

    def cancel(self, job_id: str, reason: str = "it was cancelled on request") -> Job:
        """Cancel a job, unless it has ended."""
        job = self.get(job_id)
        with self._lock:
            if job_id not in self._open:
                return job
            self._mark_cancelled(job, reason)
        self._emit(job)
        return job

    def cancel_all(self, reason: str) -> None:
        """Cancel every job that may move the rig, without using the database."""
        with self._lock:
            for job in self._open.values():
                if job.kind not in self._parallel:
                    self._mark_cancelled(job, reason)

    def _mark_cancelled(self, job: Job, reason: str) -> None:
        """Let the job end at its next check; called with the lock held."""
        self._cancelled.setdefault(job.id, reason)
        if job.state is JobState.RUNNING:
            job.state = JobState.CANCELLING

    def is_cancelled(self, job_id: str) -> bool:
        """Return whether a job was cancelled."""
        return job_id in self._cancelled

    def report(self, job: Job) -> None:
        """Emit the job's progress."""
        self._emit(job)

    def _run(self) -> None:
        while (work := self._waiting.get()) is not None:
            work()

    def _run_in_parallel(self, kind: str, work: Callable[[], None]) -> None:
        """Start a job on a thread of its own."""

        def run() -> None:
            work()
            with self._lock:
                self._threads.discard(threading.current_thread())

        thread = threading.Thread(target=run, name=f"foveacam-{kind}", daemon=True)
        with self._lock:
            self._threads.add(thread)
        thread.start()

    def _do(self, job: Job, asked_s: float) -> None:
        JOB_ID.set(job.id)
        note_span("job queue", took_s=time.perf_counter() - asked_s)
        try:
            self._work(job)
        except Exception:  # noqa: BLE001 - the worker goes on when the database fails
            _log.exception("job %s could not be written down", job.id)
        finally:
            self._forget(job)

    def _work(self, job: Job) -> None:
        try:
            if self.is_cancelled(job.id):
                raise Cancelled(f"the job did not start: {self._cancelled[job.id]}")
            self._begin(job)
            with span(f"job {job.kind}", **{"foveacam.job_id": job.id}):
                job.result_url = self._handlers[job.kind](JobContext(self, job, clock=self._clock))
            job.state = JobState.SUCCEEDED
        except Cancelled as error:
            self._ended_early(job, str(error))
        except Stopped as error:  # the mirrors refuse before the stop has cancelled the job
            self._ended_early(job, error.found or str(error))
        except FoveaError as error:
            self._failed(job, error)
        except Exception as error:  # noqa: BLE001 - a job's outermost frame: the worker goes on
            _log.exception("job %s (%s) failed unexpectedly", job.id, job.kind)
            self._failed(job, error)
        _log.info("job %s (%s): %s", job.id, job.kind, job.state.value)
        job.ended_utc = utc_now()
        job.eta_s = None
        with self._lock:
            self._unsaved[job.id] = job
        self._save_ended()
        self._emit(job)

    def _save_ended(self) -> None:
        """Write the jobs that have ended; those that the disk does not take stay in memory until it does."""
        with self._lock:
            ended = list(self._unsaved.values())
        try:
            for job in ended:
                self._table.save(job)
                with self._lock:
                    self._unsaved.pop(job.id, None)
        except FoveaError as error:
            _log.warning("ended jobs are not written down yet: %s", error)

    def _begin(self, job: Job) -> None:
        with self._lock:
            job.state = JobState.RUNNING
            job.started_utc = utc_now()
        self._table.save(job)
        self._emit(job)

    def _ended_early(self, job: Job, otherwise: str) -> None:
        reason = self._cancelled.get(job.id, otherwise)
        job.problem = problem_of(Cancelled(f"The job was cancelled: {reason}.")).document()
        job.state = JobState.CANCELLED  # last: a reader that sees the end finds the reason

    def _failed(self, job: Job, error: Exception) -> None:
        job.problem = problem_of(error).document()
        job.state = JobState.FAILED

    def _forget(self, job: Job) -> None:
        with self._lock:
            self._open.pop(job.id, None)
            self._cancelled.pop(job.id, None)
            ending = self._endings.pop(job.id, None)
        if ending is not None:
            ending.set_result(job)

    def _emit(self, job: Job) -> None:
        message = f"{job.kind} {job.id}: {job.state.value}"
        if job.problem is not None:
            message = f"{message}: {job.problem.detail}"
        level = EventLevel.ERROR if job.state is JobState.FAILED else EventLevel.INFO
        self._events.emit("job.updated", message, level=level, data=job.describe())
