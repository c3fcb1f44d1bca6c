"""The archive's jobs over a dataset of noise."""

import asyncio
from pathlib import Path

import pytest
from tests.support.scenes.dataset_scenes import written

from foveacam_pipeline.capture.archiving import dataset_item
from foveacam_pipeline.capture.dataset import Dataset
from foveacam_pipeline.storage.archive import ArchiveItem
from foveacam_server.foundation.job_table import Job, JobState
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.foundation.schema import ResponseModel
from foveacam_server.resources.capturing.archive.schema import ArchiveRequest
from foveacam_server.resources.capturing.archive.service import ArchiveService

PATIENCE_S = 30.0


class Source:
    """One dataset; implements the archive's `ArchiveSource`."""

    def __init__(self, folder: Path) -> None:
        written(folder, 1)
        self._folder = folder

    def archive_item(self, item_id: str) -> ArchiveItem:
        return dataset_item(Dataset.open(self._folder), item_id=item_id)

    def before_removal(self, item_id: str) -> None:
        return

    def report_change(self, item_id: str, message: str) -> None:
        return

    def document(self, item_id: str) -> ResponseModel:
        raise AssertionError("no test shows it")


@pytest.fixture
def archive(tmp_path: Path, jobs: JobRunner) -> ArchiveService:
    found = ArchiveService(f"file://{tmp_path}/archive", {"captures": Source(tmp_path / "one")}, jobs)
    jobs.start()
    return found


def ended(jobs: JobRunner, job: Job) -> Job:
    return asyncio.run(jobs.ended(job.id, timeout_s=PATIENCE_S))


def test_an_item_that_was_archived_is_free_for_further_jobs(archive: ArchiveService, jobs: JobRunner) -> None:
    def archived() -> Job:
        return ended(jobs, archive.archive("captures", "one", ArchiveRequest(), idempotency_key=None))

    first, second = archived(), archived()
    fetched = ended(jobs, archive.fetch("captures", "one", idempotency_key=None))

    assert {job.state for job in (first, second, fetched)} == {JobState.SUCCEEDED}
