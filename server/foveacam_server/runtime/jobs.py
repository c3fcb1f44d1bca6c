"""Runs jobs one after the other on one thread: one rig, one worker. Cancel works at every step.

Jobs that leave the rig alone may run beside these, each on a thread of its own.
"""

import asyncio
import logging
import queue
import threading
from collections.abc import Callable
from concurrent.futures import Future

from foveacam_hardware.contract import Busy, Cancelled, Clock, FoveaError, InvalidInput, Stopped
from foveacam_server.api.models import Problem
from foveacam_server.errors import problem_of
from foveacam_server.runtime.events import EventLevel, EventLog
from foveacam_server.runtime.job_table import Job, JobState, JobTable
from foveacam_server.runtime.names import new_id, utc_now
from foveacam_server.runtime.store import Document, Store

_log = logging.getLogger(__name__)

WAITING = 16
"""Jobs that may wait; more is a mistake of the caller."""


class JobContext:
    """What a running job may do: report, and notice that it was cancelled."""

    def __init__(self, runner: "JobRunner", job: Job, *, clock: Clock) -> None:
        self._runner = runner
        self._clock = clock
        self._began_ns = clock.now_ns()
        self._done_before: int | None = 0
        self.job = job

    def cancelled(self) -> bool:
        """Tell whether the job shall end."""
        return self._runner.is_cancelled(self.job.id)

    def check(self) -> None:
        """Raise `Cancelled` when the job shall end."""
        if self.cancelled():
            raise Cancelled("the job was cancelled")

    def stage(self) -> None:
        """Begin another part of the work: what its first report calls done was done before."""
        self._done_before = None

    def progress(self, done: int, *, total: int, note: str = "", left_s: float | None = None) -> None:
        """Report `done` of `total`; the time left follows from the time so far, unless it is known."""
        job = self.job
        if self._done_before is None or (job.total and total != job.total):  # another thing is counted now
            self._began_ns, self._done_before = self._clock.now_ns(), done
        job.done, job.total, job.note = done, total, note
        spent_s = (self._clock.now_ns() - self._began_ns) / 1e9
        here = done - self._done_before
        if left_s is None and here > 0 and total:
            left_s = spent_s / here * (total - done)
        job.eta_s = None if left_s is None else round(left_s, 2)
        self._runner.told(job)


Handler = Callable[[JobContext], str]
"""Does a job's work and returns the URL of its result."""


class JobRunner:
    """One worker thread over the job table."""

    def __init__(self, store: Store, *, events: EventLog, clock: Clock) -> None:
        self._table = JobTable(store)
        self._events = events
        self._clock = clock
        self._handlers: dict[str, Handler] = {}
        self._beside: set[str] = set()
        self._helpers: set[threading.Thread] = set()
        self._waiting: queue.Queue[Job | None] = queue.Queue()
        self._lock = threading.Lock()
        self._open: dict[str, Job] = {}
        self._unsaved: dict[str, Job] = {}
        """Jobs that ended on a disk that took nothing."""
        self._cancelled: dict[str, str] = {}
        self._endings: dict[str, Future[Job]] = {}
        self.interrupted = self._table.end_interrupted()
        self._thread = threading.Thread(target=self._run, name="foveacam-jobs", daemon=True)

    def handle(self, kind: str, handler: Handler, *, beside: bool = False) -> None:
        """Let `handler` do the jobs of `kind`; before `start`.

        `beside`: they move nothing. They wait for no other job and none waits for them, and the stop lets
        them go on.
        """
        self._handlers[kind] = handler
        if beside:
            self._beside.add(kind)

    def start(self) -> None:
        """Begin to work."""
        self._thread.start()

    def close(self) -> None:
        """Cancel what there is and end the thread."""
        reason = "the server is shutting down"
        self.cancel_all(reason)
        with self._lock:
            helpers = list(self._helpers)
            beside = [job.id for job in self._open.values() if job.kind in self._beside]
        for job_id in beside:
            self.cancel(job_id, reason)
        self._waiting.put(None)
        for thread in (self._thread, *helpers):
            if thread.is_alive():
                thread.join(timeout=15.0)
        self._save_ended()

    def submit(
        self,
        kind: str,
        request: Document,
        *,
        idempotency_key: str | None = None,
        total: int = 0,
        note: str = "",
    ) -> Job:
        """Enqueue a job, or return the earlier one with the same idempotency key.

        `total` and `note`: its progress before it reports any.
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
            request=request,
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
        self._tell(job)
        if kind in self._beside:
            self._help(job)
        else:
            self._waiting.put(job)
        return job

    def keyed(self, idempotency_key: str | None) -> bool:
        """Tell whether a job was asked for with this key before: `submit` then asks for nothing new."""
        return idempotency_key is not None and self._table.keyed(idempotency_key)

    def get(self, job_id: str) -> Job:
        """Return one job, as it stands now."""
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
        """How many wait or run."""
        with self._lock:
            return len(self._open)

    async def ended(self, job_id: str, *, timeout_s: float) -> Job:
        """Wait for a job to end, for so long and no longer; return it as it then stands."""
        with self._lock:
            ending = self._endings.get(job_id)
        if ending is not None:
            await asyncio.wait([asyncio.wrap_future(ending)], timeout=timeout_s)
        return self.get(job_id)

    def cancel(self, job_id: str, reason: str = "it was cancelled on request") -> Job:
        """Ask a job to end; harmless when it has ended."""
        job = self.get(job_id)
        with self._lock:
            if job_id not in self._open:
                return job
            self._cancelled.setdefault(job_id, reason)
            if job.state is JobState.RUNNING:
                job.state = JobState.CANCELLING
        self._tell(job)
        return job

    def cancel_all(self, reason: str) -> None:
        """Ask every job that may move the rig to end, without a word to the database."""
        with self._lock:
            for job in self._open.values():
                if job.kind in self._beside:
                    continue
                self._cancelled.setdefault(job.id, reason)
                if job.state is JobState.RUNNING:
                    job.state = JobState.CANCELLING

    def is_cancelled(self, job_id: str) -> bool:
        """Tell whether a job was asked to end."""
        return job_id in self._cancelled

    def told(self, job: Job) -> None:
        """Pass on a job's progress."""
        self._tell(job)

    def _run(self) -> None:
        while (job := self._waiting.get()) is not None:
            self._do(job)

    def _help(self, job: Job) -> None:
        """Begin a job on a thread of its own."""

        def help_() -> None:
            self._do(job)
            with self._lock:
                self._helpers.discard(threading.current_thread())

        thread = threading.Thread(target=help_, name=f"foveacam-{job.kind}", daemon=True)
        with self._lock:
            self._helpers.add(thread)
        thread.start()

    def _do(self, job: Job) -> None:
        try:
            self._work(job)
        except Exception:  # noqa: BLE001 - the worker must outlive a database that fails
            _log.exception("job %s could not be written down", job.id)
        finally:
            self._forget(job)

    def _work(self, job: Job) -> None:
        try:
            if self.is_cancelled(job.id):
                raise Cancelled(f"the job did not start: {self._cancelled[job.id]}")
            self._begin(job)
            job.result_url = self._handlers[job.kind](JobContext(self, job, clock=self._clock))
            job.state = JobState.SUCCEEDED
        except Cancelled as error:
            self._ended_early(job, str(error))
        except Stopped as error:  # the mirrors refuse before the stop has come round to cancel the job
            self._ended_early(job, error.found or str(error))
        except FoveaError as error:
            self._failed(job, error)
        except Exception as error:  # noqa: BLE001 - a job's outermost frame: the worker lives on
            _log.exception("job %s (%s) failed unexpectedly", job.id, job.kind)
            self._failed(job, error)
        job.ended_utc = utc_now()
        job.eta_s = None
        with self._lock:
            self._unsaved[job.id] = job
        self._save_ended()
        self._tell(job)

    def _save_ended(self) -> None:
        """Write down what has ended; what the disk does not take is known here until it does."""
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
        self._tell(job)

    def _ended_early(self, job: Job, otherwise: str) -> None:
        reason = self._cancelled.get(job.id, otherwise)
        job.problem = _problem(Cancelled(f"The job was cancelled: {reason}."))
        job.state = JobState.CANCELLED  # last: whoever sees that it has ended finds why

    def _failed(self, job: Job, error: Exception) -> None:
        job.problem = _problem(error)
        job.state = JobState.FAILED

    def _forget(self, job: Job) -> None:
        with self._lock:
            self._open.pop(job.id, None)
            self._cancelled.pop(job.id, None)
            ending = self._endings.pop(job.id, None)
        if ending is not None:
            ending.set_result(job)

    def _tell(self, job: Job) -> None:
        message = f"{job.kind} {job.id}: {job.state.value}"
        if job.problem is not None:
            message = f"{message}: {job.problem.detail}"
        level = EventLevel.ERROR if job.state is JobState.FAILED else EventLevel.INFO
        self._events.emit("job.updated", message, level=level, data=job.describe().as_json())


def _problem(error: Exception) -> Problem:
    return Problem.model_validate(problem_of(error).document())
