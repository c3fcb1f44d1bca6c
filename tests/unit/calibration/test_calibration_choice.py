import errno
import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from foveacam_hardware.contract import NotCalibrated, NotConnected, StorageFull
from foveacam_pipeline.calibrate.records.records import CalibrationStore
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.calibration_file import load_calibration, save_calibration
from foveacam_server.foundation.errors import NotFound, StillOpening
from foveacam_server.foundation.events import EventLevel, EventLog
from foveacam_server.foundation.store import Store
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED, CalibrationService

RIG = "sim-rig120"


@pytest.fixture
def events(tmp_path: Path) -> Iterator[EventLog]:
    with Store(tmp_path / "data") as store:
        log = EventLog(store)
        yield log
        log.close()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    path = tmp_path / "calibrations"
    path.mkdir()
    return path


def test_the_shipped_calibration_is_used_when_there_is_nothing_better(events: EventLog, folder: Path) -> None:
    service = CalibrationService(chosen=None, folder=folder, events=events)
    service.choose_for(RIG)
    assert service.require().origin == "measured"
    assert service.problem is None
    assert service.reach_rad is not None


def test_newer_calibration_in_the_data_folder_wins(events: EventLog, folder: Path) -> None:
    shipped = load_calibration(SHIPPED / f"{RIG}.json")
    newer = replace(shipped, label="mine", origin="measured", created_utc="2099-01-01T00:00:00+00:00")
    save_calibration(newer, folder / "mine.json")
    service = CalibrationService(chosen=None, folder=folder, events=events)
    service.choose_for(RIG)
    assert service.require().label == "mine"
    assert [known.label for known in service.every()] == ["mine", shipped.label]


def test_before_the_rig_is_open_there_is_none(events: EventLog, folder: Path) -> None:
    service = CalibrationService(chosen=None, folder=folder, events=events)
    with pytest.raises(StillOpening, match="not open yet"):
        service.require()
    service.choose_for(RIG)
    service.forget_rig()
    service.refuse_without_rig(lambda: NotConnected("the rig file is missing"))
    with pytest.raises(NotConnected, match="the rig file is missing"):
        service.require()
    assert (service.current, service.reach_rad, service.every()) == (None, None, [])


def test_calibration_of_another_rig_is_refused_naming_both(events: EventLog, folder: Path) -> None:
    service = CalibrationService(chosen=SHIPPED / "sim-paper.json", folder=folder, events=events)
    service.choose_for(RIG)
    with pytest.raises(NotCalibrated, match=r"sim-paper.*sim-rig120"):
        service.require()
    assert events.recent(1)[0].level is EventLevel.ERROR


def test_rig_without_any_calibration_says_how_to_load_one(events: EventLog, folder: Path) -> None:
    service = CalibrationService(chosen=None, folder=folder, events=events)
    service.choose_for("workshop")
    with pytest.raises(NotCalibrated, match="--calibration FILE"):
        service.require()


def test_damaged_file_in_the_data_folder_is_passed_over(events: EventLog, folder: Path) -> None:
    shutil.copy(SHIPPED / f"{RIG}.json", folder / "bad.json")
    (folder / "bad.json").write_text((folder / "bad.json").read_text()[:500])
    service = CalibrationService(chosen=None, folder=folder, events=events)
    service.choose_for(RIG)
    assert len(service.every()) == 1


def test_unknown_id_is_not_found(events: EventLog, folder: Path) -> None:
    service = CalibrationService(chosen=None, folder=folder, events=events)
    with pytest.raises(NotFound):
        service.get("0000")


def own(folder: Path, label: str, created_utc: str) -> Calibration:
    """Return a calibration of the rig's own, kept in `folder`."""
    shipped = load_calibration(SHIPPED / f"{RIG}.json")
    made = replace(shipped, label=label, origin="measured", created_utc=created_utc)
    CalibrationStore(folder).add(made)
    return made


def test_calibration_put_in_force_stays_so_after_a_restart(events: EventLog, folder: Path) -> None:
    older = own(folder, "older", "2098-01-01T00:00:00+00:00")
    own(folder, "newer", "2099-01-01T00:00:00+00:00")
    service = CalibrationService(chosen=None, folder=folder, events=events)
    service.choose_for(RIG)
    assert service.require().label == "newer"
    service.activate(older.id)
    again = CalibrationService(chosen=None, folder=folder, events=events)
    again.choose_for(RIG)
    assert again.require().id == older.id


@pytest.mark.parametrize("content", [b"", b"\xff\xfe", b"two words", None])
def test_a_damaged_pin_is_told_until_a_calibration_is_put_in_force_again(
    events: EventLog, folder: Path, content: bytes | None, caplog: pytest.LogCaptureFixture
) -> None:
    newest = own(folder, "newest", "2099-01-01T00:00:00+00:00")
    pin = folder / "in_force" / f"{RIG}.txt"
    pin.parent.mkdir()
    if content is None:
        pin.mkdir()
    else:
        pin.write_bytes(content)
    service = CalibrationService(chosen=None, folder=folder, events=events)
    service.choose_for(RIG)
    assert service.require().id == newest.id
    told = events.recent(1)[-1]
    assert (told.kind, told.level) == ("rig.calibration", EventLevel.WARNING)
    for words in (told.message, caplog.text):
        assert str(pin) in words and "put the right one in force again" in words
    if content is None:
        pin.rmdir()
    service.activate(newest.id)
    assert events.recent(1)[-1].level is EventLevel.INFO


def test_a_pinned_calibration_that_is_damaged_or_gone_is_told(
    events: EventLog, folder: Path, caplog: pytest.LogCaptureFixture
) -> None:
    older = own(folder, "older", "2098-01-01T00:00:00+00:00")
    service = CalibrationService(chosen=None, folder=folder, events=events)
    service.choose_for(RIG)
    service.activate(older.id)
    path = CalibrationStore(folder).path_of(older.id)
    path.write_bytes(b"")
    again = CalibrationService(chosen=None, folder=folder, events=events)
    again.choose_for(RIG)
    assert f"{path} is passed over" in caplog.text
    assert events.recent(1)[-1].level is EventLevel.WARNING
    assert f"calibration {older.id}, which was put in force, cannot be read" in events.recent(1)[-1].message


def test_new_calibration_comes_into_force_neither_now_nor_by_a_restart(
    events: EventLog, folder: Path
) -> None:
    service = CalibrationService(chosen=None, folder=folder, events=events)
    service.choose_for(RIG)
    before = service.require()
    new = replace(before, label="new", origin="measured", created_utc="2099-01-01T00:00:00+00:00")
    service.add(new)
    assert service.require() is before
    assert service.get(new.id) is new
    again = CalibrationService(chosen=None, folder=folder, events=events)
    again.choose_for(RIG)
    assert again.require().id == before.id


def test_change_of_calibration_is_told_with_its_reach(events: EventLog, folder: Path) -> None:
    newer = own(folder, "newer", "2099-01-01T00:00:00+00:00")
    service = CalibrationService(chosen=None, folder=folder, events=events)
    told: list[str] = []
    service.on_change(lambda calibration: told.append(calibration.id))
    service.choose_for(RIG)
    shipped = load_calibration(SHIPPED / f"{RIG}.json")
    service.activate(shipped.id)
    assert told == [newer.id, shipped.id]
    assert service.reach_rad == shipped.reach_rad()
    assert events.recent(1)[0].data["id"] == shipped.id


def test_calibration_of_another_rig_cannot_be_added(events: EventLog, folder: Path) -> None:
    service = CalibrationService(chosen=None, folder=folder, events=events)
    service.choose_for(RIG)
    with pytest.raises(NotCalibrated, match="sim-paper"):
        service.add(load_calibration(SHIPPED / "sim-paper.json"))
    assert list(folder.glob("*.json")) == []


def test_damaged_note_of_what_is_in_force_is_as_none(events: EventLog, folder: Path) -> None:
    newer = own(folder, "newer", "2099-01-01T00:00:00+00:00")
    (folder / "in_force").mkdir()
    (folder / "in_force" / f"{RIG}.txt").write_bytes(b"\xff\xfe" * 80)
    service = CalibrationService(chosen=None, folder=folder, events=events)
    service.choose_for(RIG)
    assert service.require().id == newer.id


def test_full_disk_changes_nothing_that_is_in_force_or_known(
    events: EventLog, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(path: Path, content: object, **_mode: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device", str(path))

    service = CalibrationService(chosen=None, folder=folder, events=events)
    service.choose_for(RIG)
    before, other = service.require(), replace(service.require(), label="mine")
    service.add(other)
    service.discard(other.id)
    (folder / "in_force" / f"{RIG}.txt").unlink()
    monkeypatch.setattr("foveacam_pipeline.storage.disk.write_part", full)

    for change in (service.activate, service.restore):
        known = before.id if change == service.activate else other.id
        with pytest.raises(StorageFull, match=f"calibration {before.id} as the one in force .* disk is full"):
            change(known)
    with pytest.raises(StorageFull, match="the disk is full"):
        service.add(replace(other, label="another"))

    assert service.require() is before
    assert [known.id for known in service.every()] == [before.id]
    assert [known.id for known in service.discarded()] == [other.id]
