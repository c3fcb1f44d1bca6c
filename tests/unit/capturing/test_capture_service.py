"""The service of captures: which of them may be queued beside others."""

import asyncio
from dataclasses import replace
from pathlib import Path

import pytest
from tests.support.scenes.dataset_scenes import header, noise_point

from foveacam_hardware.contract import Busy
from foveacam_pipeline.capture.dataset import DatasetWriter
from foveacam_pipeline.capture.plan import plan_from
from foveacam_server.datasets.capture_tools import CaptureTools
from foveacam_server.foundation.job_table import JobState
from foveacam_server.resources.capturing.captures.schema import CaptureRequest, EstimateRequest
from foveacam_server.resources.capturing.captures.service import CaptureService

PATIENCE_S = 60.0


@pytest.fixture
def captures(tmp_path: Path, tools: CaptureTools) -> CaptureService:
    """Two captures that ended after one point of two."""
    for name in ("first", "second"):
        about = replace(header(2), id=f"cap-{name}")
        with DatasetWriter.create(tmp_path / "captures" / name, about) as writer:
            writer.add(noise_point(0))
    return CaptureService(tmp_path / "captures", tools)


def test_the_distance_is_measured_at_the_working_binning_and_the_points_at_full_size(
    tmp_path: Path, tools: CaptureTools
) -> None:
    captures = CaptureService(tmp_path / "captures", tools)
    plan = plan_from({"points": {"kind": "grid", "columns": 2, "rows": 1}, "verging": {"mode": "scene"}})
    tools.jobs.start()
    job = captures.start(CaptureRequest(name="new", plan=plan))
    assert asyncio.run(tools.jobs.ended(job.id, timeout_s=PATIENCE_S)).state is JobState.SUCCEEDED
    assert tools.hardware.binnings == [None, 1]  # type: ignore[attr-defined]  # the stub's
    (dataset,) = captures.search()
    assert dataset.points.taken == 2


def test_an_estimate_counts_no_fixation_where_the_depth_is_known(tmp_path: Path, tools: CaptureTools) -> None:
    known = CaptureService(tmp_path / "captures", tools).plan_to_estimate(EstimateRequest())
    assert known.plan.needs_distance
    assert known.preparing_fixations == 0
    assert (known.known, replace(known, known=0).preparing_fixations) == (9, 9)


def test_no_capture_is_resumed_beside_another_that_is_queued_or_runs(captures: CaptureService) -> None:
    captures.resume("cap-first")

    with pytest.raises(Busy, match="capture first is using the rig"):
        captures.resume("cap-second")

    assert captures.is_running("cap-first")
    assert not captures.is_running("cap-second")
