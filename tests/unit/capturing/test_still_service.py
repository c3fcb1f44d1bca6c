"""The service of stills: what is kept at once, and what waits for a decision."""

import asyncio
from pathlib import Path

import pytest

from foveacam_bench.capture.stub_rig import StubRig
from foveacam_server.datasets.capture_tools import CaptureTools
from foveacam_server.foundation.job_table import Job, JobState
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.resources.capturing.stills.collection import StillState
from foveacam_server.resources.capturing.stills.schema import StillRequest
from foveacam_server.resources.capturing.stills.service import StillService

PATIENCE_S = 30.0


@pytest.fixture
def stills(tmp_path: Path, tools: CaptureTools, jobs: JobRunner) -> StillService:
    found = StillService(tmp_path / "stills", tools)
    jobs.start()
    return found


def taken(stills: StillService, jobs: JobRunner) -> Job:
    """Return the ended job of a still that is to be kept at once."""
    job = stills.start(StillRequest(stack_frames=2, name="desk", save=True))
    return asyncio.run(jobs.ended(job.id, timeout_s=PATIENCE_S))


def names(stills: StillService, state: StillState) -> list[str]:
    return [still.name for still in stills.search(state=state)]


def test_a_still_that_is_to_be_kept_at_once_is_kept(stills: StillService, jobs: JobRunner) -> None:
    assert taken(stills, jobs).state is JobState.SUCCEEDED
    assert (names(stills, StillState.KEPT), names(stills, StillState.HELD)) == (["desk"], [])


def test_a_still_whose_frames_are_missing_waits_for_a_decision(
    stub_rig: StubRig, stills: StillService, jobs: JobRunner
) -> None:
    stub_rig.left.lost = 99

    assert taken(stills, jobs).state is JobState.FAILED

    assert (names(stills, StillState.KEPT), names(stills, StillState.HELD)) == ([], ["desk"])
