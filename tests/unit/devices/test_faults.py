"""The list of faults, made of the events of a log."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.events import EventLevel, EventLog
from foveacam_server.foundation.schema import JobDocument, JobProgress, Problem, StorageFault
from foveacam_server.foundation.store import Store
from foveacam_server.resources.devices.faults.schema import FaultDocument
from foveacam_server.resources.devices.faults.service import MOST, FaultService
from foveacam_server.rig.schema import DeviceName, DeviceProblemDocument, StopChange, StopDocument

STOPPED = StopDocument(engaged=True, since_utc=None, by="me")


@pytest.fixture
def log(tmp_path: Path) -> Iterator[EventLog]:
    with Store(tmp_path) as store:
        found = EventLog(store)
        yield found
        found.close()


@pytest.fixture
def faults(log: EventLog) -> FaultService:
    return FaultService(log)


def lose(log: EventLog, device: str, detail: str = "it does not answer") -> None:
    problem = DeviceProblemDocument(device=device, detail=detail, remedy="check its cable")
    log.emit("device.fault", f"{device}: {detail}", level=EventLevel.ERROR, data=problem)


def recover(log: EventLog, device: str) -> None:
    log.emit("device.recovered", f"{device} is back", data=DeviceName(device=device))


def fail_job(log: EventLog, kind: str, detail: str) -> None:
    problem = Problem(type="/problems/timeout", title="Late", status=504, detail=detail, remedy="try again")
    job = JobDocument(
        id="job-1",
        kind=kind,
        state="failed",
        created_utc="",
        started_utc=None,
        ended_utc=None,
        progress=JobProgress(done=0, total=0, eta_s=None, note=""),
        result_url=None,
        problem=problem,
    )
    log.emit("job.updated", f"{kind} job-1: failed", level=EventLevel.ERROR, data=job)


def only(faults: FaultService) -> FaultDocument:
    (found,) = faults.describe()
    return found


def kinds(log: EventLog) -> list[str]:
    return [event.kind for event in log.recent(500)]


def test_a_lost_device_is_present_until_it_is_back(log: EventLog, faults: FaultService) -> None:
    lose(log, "mirrors")
    lost = only(faults)
    recover(log, "mirrors")
    back = only(faults)

    assert (lost.scope, lost.name, lost.level, lost.present) == ("device", "mirrors", "error", True)
    assert (lost.what, lost.remedy, lost.over_utc) == ("it does not answer", "check its cable", None)
    assert (back.id, back.present, back.over_utc) == (lost.id, False, log.recent(500)[-2].t_utc)


def test_a_fault_that_comes_again_is_counted_on_its_row_with_its_newest_words(
    log: EventLog, faults: FaultService
) -> None:
    lose(log, "mirrors")
    first = only(faults)
    recover(log, "mirrors")
    lose(log, "mirrors", "its supply is off")
    again = only(faults)

    assert (again.id, again.count, again.present) == (first.id, 2, True)
    assert (again.what, again.first_utc) == ("its supply is off", first.first_utc)


def test_failed_jobs_are_over_at_once_and_counted_by_kind_and_reason(
    log: EventLog, faults: FaultService
) -> None:
    for kind, detail in (
        ("fixation", "late"),
        ("fixation", "late"),
        ("fixation", "dark"),
        ("capture", "late"),
    ):
        fail_job(log, kind, detail)

    found = [(row.name, row.what, row.count, row.present) for row in faults.describe()]
    assert found == [
        ("capture", "late", 1, False),
        ("fixation", "dark", 1, False),
        ("fixation", "late", 2, False),
    ]


def test_errors_come_before_warnings_and_the_newest_first(log: EventLog, faults: FaultService) -> None:
    lose(log, "left")
    log.emit("viewer.failed", "no 3D pane", level=EventLevel.WARNING)
    lose(log, "right")

    assert [(row.level, row.name) for row in faults.describe()] == [
        ("error", "right"),
        ("error", "left"),
        ("warning", "3D"),
    ]


def test_a_full_disk_lasts_until_events_are_written_again(log: EventLog, faults: FaultService) -> None:
    fault = StorageFault(detail="full", remedy="make room")
    log.emit("storage.fault", "it takes no events", level=EventLevel.ERROR, data=fault)
    assert (only(faults).scope, only(faults).present, only(faults).remedy) == ("storage", True, "make room")

    log.emit("storage.recovered", "events are written down again")
    assert not only(faults).present


def test_a_stop_is_a_fault_only_while_the_mirrors_do_not_confirm(log: EventLog, faults: FaultService) -> None:
    log.emit(
        "stop.engaged",
        "parked",
        level=EventLevel.WARNING,
        data=StopChange(by="me", parked=True, stop=STOPPED),
    )
    assert faults.describe() == []

    log.emit(
        "stop.engaged",
        "silent",
        level=EventLevel.WARNING,
        data=StopChange(by="me", parked=False, stop=STOPPED),
    )
    assert only(faults).present

    log.emit("stop.released", "released", data=StopChange(by="me", stop=STOPPED))
    assert not only(faults).present


def test_an_answer_without_distance_is_no_fault_and_any_other_warning_is(
    log: EventLog, faults: FaultService
) -> None:
    log.emit("fixation.done", "no texture", level=EventLevel.WARNING)
    log.emit("camera.settings", "left does not take 3 ms", level=EventLevel.WARNING)
    log.emit("camera.settings", "left has 3 ms")

    found = only(faults)
    assert (found.scope, found.name, found.present) == ("camera", "settings", False)


def test_a_dismissed_fault_is_listed_again_when_it_comes_again(log: EventLog, faults: FaultService) -> None:
    lose(log, "left")
    dismissed = only(faults)
    faults.dismiss(dismissed.id)
    assert faults.describe() == []

    recover(log, "left")
    assert faults.describe() == []

    lose(log, "left")
    assert only(faults).count == 1
    assert only(faults).id != dismissed.id
    assert "fault.dismissed" in kinds(log)


def test_dismissing_all_leaves_what_is_present(log: EventLog, faults: FaultService) -> None:
    lose(log, "left")
    lose(log, "right")
    recover(log, "left")
    fail_job(log, "capture", "late")

    assert len(faults.dismiss_over().ids) == 2
    assert only(faults).name == "right"
    assert faults.dismiss_over().ids == []
    assert kinds(log).count("fault.dismissed") == 1


def test_dismissing_what_is_not_listed_is_refused(faults: FaultService) -> None:
    with pytest.raises(NotFound, match="fault-1"):
        faults.dismiss("fault-1")


def test_the_list_is_bounded_and_keeps_what_is_present(log: EventLog, faults: FaultService) -> None:
    lose(log, "left")
    for number in range(MOST + 10):
        fail_job(log, "capture", f"reason {number}")

    rows = faults.describe()
    assert len(rows) == MOST
    assert rows[-1].name == "left"
    assert rows[0].what == f"reason {MOST + 9}"


def test_each_change_is_told_with_the_row(log: EventLog, faults: FaultService) -> None:
    lose(log, "left")
    recover(log, "left")
    recover(log, "left")

    told = [event for event in log.recent(500) if event.kind == "fault.changed"]
    assert [event.data["present"] for event in told] == [True, False]
    assert told[0].data["id"] == only(faults).id
    assert all(event.level is EventLevel.INFO for event in told)
