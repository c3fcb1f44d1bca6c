"""Runs jobs one after the other on one thread, as they share one rig; they can be cancelled at every step.

Jobs that do not move the rig run in parallel, a few of each kind at once. Persons take turns.
"""

import asyncio
import logging
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from contextvars import copy_context
from functools import partial

from foveacam_hardware.contract import Cancelled, Clock, FoveaError, InvalidInput, Stopped
from foveacam_hardware.contract.spans import note_span, span
from foveacam_server.foundation.errors import problem_of
from foveacam_server.foundation.events import EventLevel, EventLog
from foveacam_server.foundation.job_lanes import JobLane, Work
from foveacam_server.foundation.job_table import Job, JobState, JobTable
from foveacam_server.foundation.names import new_id, utc_now
from foveacam_server.foundation.persons.person_quota import PERSON, Person, Places
from foveacam_server.foundation.schema import RequestModel
from foveacam_server.foundation.store import Store
from foveacam_server.foundation.watching.flows import count_flow, this_part
from foveacam_server.foundation.watching.work_ids import JOB_ID, REQUEST_ID

_log = logging.getLogger(__name__)

MOST_OPEN, MOST_OPEN_EACH = 32, 8
"""Largest number of queued and running jobs, of all persons and of one; further ones are refused."""
PARALLEL_AT_ONCE = 4
"""Default number of jobs of a parallel kind that run at once."""


class JobContext:
    """Context of a running job, by which it reports progress and checks for cancellation."""

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
        """Start another part of the work; the count of its first report is the base of the time left."""
        self._done_before = None

    def progress(self, done: int, *, total: int, note: str = "", left_s: float | None = None) -> None:
        """Report `done` of `total`; the time left is extrapolated unless `left_s` is given."""
        job = self.job
        if self._done_before is None or (job.total and total != job.total):  # a new total: a new unit
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
    """Queues jobs and runs them on worker threads; stores their states in the job table."""

    def __init__(self, store: Store, *, events: EventLog, clock: Clock) -> None:
        self._table = JobTable(store)
        self._events = events
        self._clock = clock
        self._handlers: dict[str, Handler] = {}
        self._parallel: dict[str, JobLane] = {}
        self._lane = JobLane("foveacam-jobs", at_once=1)
        self.places = Places(
            "jobs", most=MOST_OPEN, most_each=MOST_OPEN_EACH, remedy="wait until one has ended, or cancel one"
        )
        self._works: dict[str, tuple[Person, Work]] = {}
        self._lock = threading.Lock()
        self._open: dict[str, Job] = {}
        self._unsaved: dict[str, Job] = {}
        """Ended jobs that could not be written to the disk yet."""
        self._cancelled: dict[str, str] = {}
        self._endings: dict[str, Future[Job]] = {}
        self.interrupted = self._table.end_interrupted()

    def handle(
        self, kind: str, handler: Handler, *, parallel: bool = False, at_once: int = PARALLEL_AT_ONCE
    ) -> None:
        """Register the handler of the jobs of `kind`; before `start`.

        `parallel`: run independently of jobs of other kinds, at most `at_once` together; the stop does not
        cancel them. One that moves the rig (following) yields it to other jobs and ends by itself at the
        stop.
        """
        self._handlers[kind] = handler
        if parallel:
            lane = self._parallel[kind] = JobLane(f"foveacam-{kind}", at_once=at_once)
            lane.start()

    def start(self) -> None:
        """Start the worker thread."""
        self._lane.start()

    def begin_close(self) -> None:
        """Cancel all jobs, without waiting and without the database."""
        with self._lock:
            for job in self._open.values():
                self._mark_cancelled(job, "the server is shutting down")

    def close(self) -> None:
        """Cancel all jobs and end the threads."""
        self.begin_close()
        lanes = (self._lane, *self._parallel.values())
        for thread in [thread for lane in lanes for thread in lane.close()]:
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

        `request`: None for a kind without one. `total` and `note`: initial progress.
        """
        if kind not in self._handlers:
            raise InvalidInput(f"there is no kind of job called {kind}")
        job = Job(
            id=new_id("job"),
            kind=kind,
            request={} if request is None else request.as_json(),
            idempotency_key=idempotency_key,
            total=total,
            note=note,
        )
        if self.has_key(idempotency_key):
            return self.get(self._table.add(job).id)
        person = PERSON.get()
        self.places.take(person)
        kept = None
        try:
            kept = self._table.add(job)
        finally:
            if kept is not job:
                self.places.give_back(person)
        if kept is not job:
            return self.get(kept.id)
        self._enqueue(job, person)
        return job

    def _enqueue(self, job: Job, person: Person) -> None:
        """Put a job into the lane of its kind."""
        context = copy_context()  # keeps ids and trace of the request
        work = Work(partial(context.run, self._do, job, time.perf_counter()))
        with self._lock:
            self._open[job.id] = job
            self._endings[job.id] = Future()
            self._works[job.id] = person, work
        self._emit(job)
        _log.info(
            "job %s (%s) was asked for by request %s", job.id, job.kind, REQUEST_ID.get() or "of nobody"
        )
        count_flow(this_part(), f"foveacam-{job.kind if job.kind in self._parallel else 'jobs'}", "jobs")
        self._lane_of(job).put(person, work)

    def _lane_of(self, job: Job) -> JobLane:
        return self._parallel.get(job.kind, self._lane)

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
        """Number of queued and running jobs."""
        with self._lock:
            return len(self._open)

    async def ended(self, job_id: str, *, timeout_s: float) -> Job:
        """Wait for a job to end, at most `timeout_s`; return its state then."""
        with self._lock:
            ending = self._endings.get(job_id)
        if ending is not None:
            await asyncio.wait([asyncio.wrap_future(ending)], timeout=timeout_s)
        return self.get(job_id)

    def cancel(self, job_id: str, reason: str = "it was cancelled on request") -> Job:
        """Cancel a job, unless it has ended; a queued one ends at once."""
        job = self.get(job_id)
        with self._lock:
            if job_id not in self._open:
                return job
            self._mark_cancelled(job, reason)
            _, work = self._works[job_id]
        if self._lane_of(job).withdraw(work):
            work.run()
        else:
            self._emit(job)
        return job

    def cancel_all(self, reason: str) -> None:
        """Cancel every job that may move the rig, without using the database."""
        with self._lock:
            for job in self._open.values():
                if job.kind not in self._parallel:
                    self._mark_cancelled(job, reason)

    def _mark_cancelled(self, job: Job, reason: str) -> None:
        """Mark the job as cancelled, so that it ends at its next check; call with the lock held."""
        self._cancelled.setdefault(job.id, reason)
        if job.state is JobState.RUNNING:
            job.state = JobState.CANCELLING

    def is_cancelled(self, job_id: str) -> bool:
        """Return whether a job was cancelled."""
        return job_id in self._cancelled

    def report(self, job: Job) -> None:
        """Emit the job's progress."""
        self._emit(job)

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
        except Stopped as error:  # the mirrors may refuse before the stop has cancelled the job
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
        """Write the ended jobs; those that the disk refuses stay in memory and are retried."""
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
        job.state = JobState.CANCELLED  # last, so that a reader that sees the end finds the reason

    def _failed(self, job: Job, error: Exception) -> None:
        job.problem = problem_of(error).document()
        job.state = JobState.FAILED

    def _forget(self, job: Job) -> None:
        with self._lock:
            self._open.pop(job.id, None)
            self._cancelled.pop(job.id, None)
            ending = self._endings.pop(job.id, None)
            person, _ = self._works.pop(job.id)
        self.places.give_back(person)
        if ending is not None:
            ending.set_result(job)

    def _emit(self, job: Job) -> None:
        message = f"{job.kind} {job.id}: {job.state.value}"
        if job.problem is not None:
            message = f"{message}: {job.problem.detail}"
        level = EventLevel.ERROR if job.state is JobState.FAILED else EventLevel.INFO
        self._events.emit("job.updated", message, level=level, data=job.describe())
