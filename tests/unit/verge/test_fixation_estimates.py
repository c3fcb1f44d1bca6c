"""Estimates of fixations that run: told by events, shown on request, forgotten at the end."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from foveacam_pipeline.verge.distance import LocatedPoint
from foveacam_pipeline.verge.estimate import DistanceEstimate
from foveacam_pipeline.verge.values import Basis
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.job_table import Job
from foveacam_server.foundation.store import Store
from foveacam_server.resources.looking.fixations.estimates import FixationEstimates

JOB = Job(id="job-1", kind="fixation", request={})
POINT = LocatedPoint(point_rig_m=(0.0, 0.0, 8.0), distance_m=8.0, distance_sigma_m=0.6)
KNOWN = DistanceEstimate(looks=0, basis=Basis.SURROUNDINGS, point=POINT)


@pytest.fixture
def events(tmp_path: Path) -> Iterator[EventLog]:
    log = EventLog(Store(tmp_path))
    yield log
    log.close()


def test_each_estimate_is_an_event_with_its_fixation_and_job(events: EventLog) -> None:
    with FixationEstimates(events).reporting("fix-1", JOB) as report:
        report(KNOWN)
    (event,) = events.recent(9)
    assert event.kind == "fixation.estimate"
    assert event.message == "at 8.00 ± 0.60 m from its surroundings, before the first look"
    told = {key: event.data[key] for key in ("fixation_id", "job_id", "step", "basis", "distance_sigma_m")}
    assert told == {
        "fixation_id": "fix-1",
        "job_id": "job-1",
        "step": 0,
        "basis": "surroundings",
        "distance_sigma_m": 0.6,
    }
    assert event.data["elapsed_ms"] >= 0.0


def test_newest_estimate_is_shown_while_the_fixation_runs_and_no_distance_before_one_is_known(
    events: EventLog,
) -> None:
    estimates = FixationEstimates(events)
    with estimates.reporting("fix-1", JOB) as report:
        (unknown,) = estimates.newest()
        report(KNOWN)
        found = estimates.find("fix-1")
    assert (unknown.fixation_id, unknown.distance_m, unknown.basis) == ("fix-1", None, None)
    assert found is not None and found.distance_m == 8.0
    assert estimates.newest() == [] and estimates.find("fix-1") is None


def test_fixation_that_fails_leaves_no_estimate(events: EventLog) -> None:
    estimates = FixationEstimates(events)
    with pytest.raises(OSError, match="unplugged"), estimates.reporting("fix-1", JOB) as report:
        report(KNOWN)
        raise OSError("unplugged")
    assert estimates.newest() == []
