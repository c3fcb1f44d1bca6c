"""A database on a disk that takes no more: told in words, and nothing that ended is forgotten."""

import asyncio
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from sqlalchemy import text

from foveacam_hardware.contract import StorageFull, VirtualClock
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.job_table import Job, JobState, JobTable
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.foundation.store import Store

PATIENCE_S = 30.0


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with Store(tmp_path) as found:
        yield found


@pytest.fixture
def jobs(store: Store) -> Iterator[JobRunner]:
    events = EventLog(store)
    found = JobRunner(store, events=events, clock=VirtualClock())
    yield found
    found.close()
    events.close()


def ended(jobs: JobRunner, job: Job) -> Job:
    return asyncio.run(jobs.ended(job.id, timeout_s=PATIENCE_S))


def test_a_database_that_cannot_be_written_is_a_fault_with_its_folder_and_a_remedy(store: Store) -> None:
    with store.session() as session:
        session.execute(text("PRAGMA query_only = 1"))
    with pytest.raises(StorageFull, match="the disk cannot be written") as refused:
        JobTable(store).add(Job(id="job-1", kind="quick", request={}))
    assert str(store.folder) in str(refused.value)
    assert refused.value.remedy == "make the folder writable, then try again"


def test_a_full_database_is_a_fault_too(store: Store) -> None:
    with store.session() as session:
        session.execute(text("PRAGMA max_page_count = 1"))
    with pytest.raises(StorageFull, match=r"the disk is full \([0-9.]+ MB free\)"):
        JobTable(store).add(Job(id="job-1", kind="quick", request={"long": "x" * 100_000}))


def test_a_job_that_ends_on_a_bad_disk_has_ended_and_is_written_down_later(
    store: Store, jobs: JobRunner, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(_table: JobTable, _job: Job) -> None:
        raise StorageFull("the database: the disk is full; free some space")

    def failing(_context: object) -> str:
        monkeypatch.setattr(JobTable, "save", refused)
        raise StorageFull("point 3: the disk is full; free some space")

    handlers: dict[str, Callable[..., str]] = {"fail": failing, "quick": lambda _: "/done"}
    for kind, handler in handlers.items():
        jobs.handle(kind, handler)
    jobs.start()

    failed = ended(jobs, jobs.submit("fail"))

    assert (failed.state, jobs.get(failed.id).state) == (JobState.FAILED, JobState.FAILED)
    assert [job.state for job in jobs.newest(5)] == [JobState.FAILED]
    assert JobTable(store).get(failed.id).state is JobState.RUNNING
    monkeypatch.undo()
    ended(jobs, jobs.submit("quick"))
    kept = JobTable(store).get(failed.id)
    assert (kept.state, kept.problem) == (JobState.FAILED, failed.problem)
