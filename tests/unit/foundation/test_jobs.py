import asyncio
import logging
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from foveacam_hardware.contract import DeviceFault, InvalidInput, MonotonicClock, Stopped, VirtualClock
from foveacam_server.foundation.errors import AllTaken, NotFound, PersonLimit
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.job_table import Job, JobState, JobTable
from foveacam_server.foundation.jobs import MOST_OPEN, MOST_OPEN_EACH, JobContext, JobRunner
from foveacam_server.foundation.persons.person_quota import PERSON
from foveacam_server.foundation.schema import RequestModel
from foveacam_server.foundation.store import Store
from foveacam_server.foundation.watching.work_ids import JOB_ID, REQUEST_ID

PATIENCE_S = 10.0


class Bench:
    """A runner with one kind of job that waits until it is told to go on."""

    def __init__(self, store: Store, clock: VirtualClock) -> None:
        self.clock = clock
        self.events = EventLog(store)
        self.jobs = JobRunner(store, events=self.events, clock=clock)
        self.running = threading.Event()
        self.go = threading.Event()
        self.failure: Exception | None = None
        self.jobs.handle("wait", self._wait)
        self.jobs.handle("quick", lambda context: f"/results/{context.job.id}")
        self.jobs.start()

    def _wait(self, context: JobContext) -> str:
        self.running.set()
        assert self.go.wait(PATIENCE_S)
        if self.failure is not None:
            raise self.failure
        context.check()
        return "/results/waited"

    def end(self, job: Job) -> Job:
        return asyncio.run(self.jobs.ended(job.id, timeout_s=PATIENCE_S))


@pytest.fixture(autouse=True)
def no_person() -> Iterator[None]:
    before = PERSON.set(None)
    yield
    PERSON.reset(before)


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with Store(tmp_path) as found:
        yield found


@pytest.fixture
def bench(store: Store) -> Iterator[Bench]:
    found = Bench(store, VirtualClock())
    yield found
    found.go.set()
    found.jobs.close()
    found.events.close()


def test_job_runs_to_its_result(bench: Bench) -> None:
    job = bench.end(bench.jobs.submit("quick", Order(n=1)))
    assert (job.state, job.result_url) == (JobState.SUCCEEDED, f"/results/{job.id}")
    assert job.started_utc is not None
    assert job.ended_utc is not None


class Order(RequestModel):
    n: int
    note: str | None = None


def test_request_is_stored_and_parsed_by_its_schema(bench: Bench) -> None:
    job = bench.end(bench.jobs.submit("quick", Order(n=1)))
    kept = bench.jobs.get(job.id)
    assert kept.request == {"n": 1, "note": None}
    assert kept.parse_request(Order) == Order(n=1)


def test_jobs_run_one_after_the_other(bench: Bench) -> None:
    first, second = bench.jobs.submit("wait"), bench.jobs.submit("quick")
    assert bench.running.wait(PATIENCE_S)
    assert bench.jobs.get(second.id).state is JobState.QUEUED
    bench.go.set()
    bench.end(second)
    assert bench.jobs.get(first.id).state is JobState.SUCCEEDED


def test_failed_job_tells_its_cause_as_a_problem(bench: Bench) -> None:
    bench.failure = DeviceFault("controller: it broke", found="smoke", remedy="buy another")
    bench.go.set()
    job = bench.end(bench.jobs.submit("wait"))
    assert job.state is JobState.FAILED
    assert job.problem is not None
    assert job.problem.type == "/problems/device-fault"
    assert job.problem.detail == "controller: it broke; buy another"
    assert job.problem.remedy == "buy another"


def test_error_that_nobody_foresaw_fails_one_job_and_not_the_next(
    bench: Bench, caplog: pytest.LogCaptureFixture
) -> None:
    bench.failure = ZeroDivisionError("secret")
    bench.go.set()
    failed = bench.end(bench.jobs.submit("wait"))
    assert failed.problem is not None
    assert failed.problem.type == "/problems/internal"
    assert "secret" not in str(failed.problem)
    assert "secret" in caplog.text
    assert bench.end(bench.jobs.submit("quick")).state is JobState.SUCCEEDED


def test_cancelled_while_queued_it_never_starts(bench: Bench) -> None:
    first, second = bench.jobs.submit("wait"), bench.jobs.submit("quick")
    assert bench.running.wait(PATIENCE_S)
    bench.jobs.cancel(second.id)
    bench.go.set()
    ended = bench.end(second)
    assert (ended.state, ended.started_utc) == (JobState.CANCELLED, None)
    assert bench.end(first).state is JobState.SUCCEEDED


def test_cancelled_while_running_it_ends_at_its_next_step(bench: Bench) -> None:
    job = bench.jobs.submit("wait")
    assert bench.running.wait(PATIENCE_S)
    assert bench.jobs.cancel(job.id).state is JobState.CANCELLING
    bench.go.set()
    ended = bench.end(job)
    assert ended.state is JobState.CANCELLED
    assert ended.problem is not None
    assert "cancelled on request" in ended.problem.detail


def test_cancelling_an_ended_job_changes_nothing(bench: Bench) -> None:
    job = bench.end(bench.jobs.submit("quick"))
    assert bench.jobs.cancel(job.id).state is JobState.SUCCEEDED


def test_cancel_all_names_its_reason(bench: Bench) -> None:
    job = bench.jobs.submit("wait")
    assert bench.running.wait(PATIENCE_S)
    bench.jobs.cancel_all("the stop was engaged")
    bench.go.set()
    problem = bench.end(job).problem
    assert problem is not None
    assert "the stop was engaged" in problem.detail


def test_refused_by_the_stop_before_it_has_cancelled_the_job_it_counts_as_cancelled(bench: Bench) -> None:
    bench.failure = Stopped("asked to move: no", found="the stop is engaged")
    bench.go.set()
    ended = bench.end(bench.jobs.submit("wait"))
    assert ended.state is JobState.CANCELLED
    assert ended.problem is not None
    assert "the stop is engaged" in ended.problem.detail


def test_too_many_waiting_jobs_are_refused(bench: Bench) -> None:
    bench.jobs.submit("wait")
    assert bench.running.wait(PATIENCE_S)
    for _ in range(MOST_OPEN - 1):
        bench.jobs.submit("quick")
    with pytest.raises(AllTaken, match=f"all {MOST_OPEN} places for jobs are taken"):
        bench.jobs.submit("quick")
    bench.go.set()
    bench.end(bench.jobs.newest(1)[0])
    bench.jobs.submit("quick")


def test_jobs_of_one_person_are_limited_whether_they_wait_or_run(bench: Bench) -> None:
    PERSON.set("mia")
    first = bench.jobs.submit("wait", idempotency_key="first")
    assert bench.running.wait(PATIENCE_S)
    for _ in range(MOST_OPEN_EACH - 1):
        bench.jobs.submit("quick")
    with pytest.raises(PersonLimit, match=f"you hold {MOST_OPEN_EACH} jobs"):
        bench.jobs.submit("quick")
    assert bench.jobs.submit("wait", idempotency_key="first").id == first.id
    PERSON.set("ben")
    bench.jobs.submit("quick")


def test_persons_take_turns(bench: Bench) -> None:
    order: list[str] = []

    def note(context: JobContext) -> str:
        order.append(f"{PERSON.get()} {context.job.note}")
        return ""

    bench.jobs.handle("note", note)
    bench.jobs.submit("wait")
    assert bench.running.wait(PATIENCE_S)
    for person in ("mia", "mia", "mia", "ben"):
        PERSON.set(person)
        last = bench.jobs.submit("note", note=str(len(bench.jobs.newest(100))))
    bench.go.set()
    for job in bench.jobs.newest(4):
        bench.end(job)
    assert last.state is JobState.SUCCEEDED
    assert order == ["mia 1", "ben 4", "mia 2", "mia 3"]


def test_parallel_jobs_of_a_kind_share_few_threads_of_which_one_person_never_has_all(bench: Bench) -> None:
    begun, go = threading.Semaphore(0), threading.Event()
    threads: set[int] = set()

    def film(_context: JobContext) -> str:
        threads.add(threading.get_ident())
        begun.release()
        assert go.wait(PATIENCE_S)
        return ""

    bench.jobs.handle("film", film, parallel=True, at_once=2)
    jobs = []
    for person in ("mia", "mia", "mia", "ben", "ben"):
        PERSON.set(person)
        jobs.append(bench.jobs.submit("film"))
    for _ in range(2):
        assert begun.acquire(timeout=PATIENCE_S)
    states = [bench.jobs.get(job.id).state for job in jobs]
    assert states == [JobState.RUNNING, *[JobState.QUEUED] * 2, JobState.RUNNING, JobState.QUEUED]
    go.set()
    assert all(bench.end(job).state is JobState.SUCCEEDED for job in jobs)
    assert len(threads) == 2


def test_a_cancelled_job_that_waits_ends_at_once(bench: Bench) -> None:
    bench.jobs.submit("wait")
    assert bench.running.wait(PATIENCE_S)
    waiting = bench.jobs.submit("quick")
    assert bench.jobs.cancel(waiting.id).state is JobState.CANCELLED
    assert bench.jobs.places.taken == 1


def test_progress_tells_the_time_left_from_the_time_so_far(bench: Bench) -> None:
    seen: list[float | None] = []

    def count(context: JobContext) -> str:
        bench.clock.sleep_until_ns(bench.clock.now_ns() + 6_000_000_000)
        context.progress(3, total=5, note="half way")
        seen.append(context.job.eta_s)
        return ""

    bench.jobs.handle("count", count)
    job = bench.end(bench.jobs.submit("count"))
    assert seen == [4.0]
    assert (job.done, job.total, job.note) == (3, 5, "half way")


def test_what_was_done_before_another_thing_is_counted_does_not_shorten_the_time_left(bench: Bench) -> None:
    seen: list[float | None] = []

    def count(context: JobContext) -> str:
        for done, total in (
            (0, 1),
            (39, 41),
            (40, 41),
        ):  # the way there, then what a resumed step has already
            bench.clock.sleep_until_ns(bench.clock.now_ns() + 6_000_000_000)
            context.progress(done, total=total)
            seen.append(context.job.eta_s)
        return ""

    bench.jobs.handle("count", count)
    bench.end(bench.jobs.submit("count"))
    assert seen == [None, None, 6.0]


def test_same_key_and_request_give_the_same_job(bench: Bench) -> None:
    first = bench.jobs.submit("quick", Order(n=1), idempotency_key="k")
    assert bench.jobs.submit("quick", Order(n=1), idempotency_key="k").id == first.id


def test_same_key_with_another_request_is_refused(bench: Bench) -> None:
    bench.jobs.submit("quick", Order(n=1), idempotency_key="k")
    with pytest.raises(InvalidInput, match="was used for another request"):
        bench.jobs.submit("quick", Order(n=2), idempotency_key="k")


def test_waiting_for_a_job_gives_up_after_its_time(bench: Bench) -> None:
    job = bench.jobs.submit("wait")
    assert bench.running.wait(PATIENCE_S)
    assert asyncio.run(bench.jobs.ended(job.id, timeout_s=0.01)).state is JobState.RUNNING


def test_every_change_of_a_job_is_told(bench: Bench) -> None:
    job = bench.end(bench.jobs.submit("quick"))
    told = [event.data["state"] for event in bench.events.recent(10) if event.data.get("id") == job.id]
    assert told == ["queued", "running", "succeeded"]


def test_unknown_job_is_not_found(bench: Bench) -> None:
    with pytest.raises(NotFound, match="there is no job job-none"):
        bench.jobs.get("job-none")


def test_restart_fails_what_it_interrupted_and_keeps_what_had_ended(store: Store) -> None:
    table = JobTable(store)
    for state in JobState:
        job = table.add(Job(id=f"job-{state}", kind="quick", request={}))
        job.state = state
        table.save(job)
    events = EventLog(store)
    jobs = JobRunner(store, events=events, clock=MonotonicClock())
    states = {job.id: job.state for job in jobs.newest(10)}
    events.close()
    assert jobs.interrupted == 3
    assert states == {
        "job-queued": JobState.FAILED,
        "job-running": JobState.FAILED,
        "job-cancelling": JobState.FAILED,
        "job-cancelled": JobState.CANCELLED,
        "job-failed": JobState.FAILED,
        "job-succeeded": JobState.SUCCEEDED,
    }
    problem = jobs.get("job-running").problem
    assert problem is not None
    assert "interrupted by a restart" in problem.detail


def test_a_job_beside_waits_for_no_other_and_the_stop_lets_it_go_on(bench: Bench) -> None:
    seen: list[str] = []
    go = threading.Event()

    def observe(context: JobContext) -> str:
        seen.append("began")
        assert go.wait(PATIENCE_S)
        context.check()
        return "/results/seen"

    bench.jobs.handle("observe", observe, parallel=True)
    first = bench.jobs.submit("wait")
    assert bench.running.wait(PATIENCE_S)
    beside = bench.jobs.submit("observe")
    bench.jobs.cancel_all("the stop was engaged")
    go.set()

    assert bench.end(beside).state is JobState.SUCCEEDED
    assert bench.jobs.get(first.id).state is JobState.CANCELLING


def test_the_end_of_the_server_cancels_a_job_beside_and_waits_for_it(store: Store) -> None:
    events = EventLog(store)
    jobs = JobRunner(store, events=events, clock=MonotonicClock())
    began, noticed = threading.Event(), threading.Event()

    def observe(context: JobContext) -> str:
        began.set()
        while not context.cancelled():
            noticed.wait(0.001)
        noticed.set()
        context.check()
        return ""

    jobs.handle("observe", observe, parallel=True)
    jobs.start()
    job = jobs.submit("observe")
    assert began.wait(PATIENCE_S)
    jobs.close()
    events.close()

    assert noticed.is_set()
    assert jobs.get(job.id).state is JobState.CANCELLED


def test_the_begin_of_the_end_cancels_every_job_without_waiting(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    began = threading.Event()

    def observe(context: JobContext) -> str:
        began.set()
        assert bench.go.wait(PATIENCE_S)
        context.check()
        return ""

    bench.jobs.handle("observe", observe, parallel=True)
    jobs = [bench.jobs.submit("wait"), bench.jobs.submit("quick"), bench.jobs.submit("observe")]
    assert bench.running.wait(PATIENCE_S)
    assert began.wait(PATIENCE_S)
    with monkeypatch.context() as patched:
        patched.setattr(JobTable, "save", lambda *_args: pytest.fail("the database was used"))
        bench.jobs.begin_close()
    bench.go.set()
    for job in jobs:
        ended = bench.end(job)
        assert ended.state is JobState.CANCELLED
        assert ended.problem is not None
        assert "the server is shutting down" in ended.problem.detail


@pytest.mark.parametrize("parallel", [False, True])
def test_a_job_works_under_its_id_and_that_of_its_request(store: Store, parallel: bool) -> None:
    seen: list[tuple[str | None, str | None]] = []

    def note(context: JobContext) -> str:
        seen.append((REQUEST_ID.get(), JOB_ID.get()))
        return "/results/noted"

    bench = Bench(store, VirtualClock())
    bench.jobs.handle("note", note, parallel=parallel)
    token = REQUEST_ID.set("req-7")
    try:
        asked = bench.end(bench.jobs.submit("note"))
    finally:
        REQUEST_ID.reset(token)
        own = bench.end(bench.jobs.submit("note"))
        bench.go.set()
        bench.jobs.close()
        bench.events.close()
    assert seen == [("req-7", asked.id), (None, own.id)]


def test_a_job_tells_the_log_which_request_asked_for_it(
    bench: Bench, caplog: pytest.LogCaptureFixture
) -> None:
    token = REQUEST_ID.set("req-8")
    try:
        with caplog.at_level(logging.INFO):
            job = bench.end(bench.jobs.submit("quick"))
    finally:
        REQUEST_ID.reset(token)
    told = [record.getMessage() for record in caplog.records]
    assert told == [
        f"job {job.id} (quick) was asked for by request req-8",
        f"job {job.id} (quick): succeeded",
    ]
