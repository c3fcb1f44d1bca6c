import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from foveacam_hardware.contract import NotCalibrated
from foveacam_pipeline.models.calibration_file import load_calibration, save_calibration
from foveacam_server.errors import NotFound
from foveacam_server.runtime.calibrations import FACTORY, CalibrationService
from foveacam_server.runtime.events import EventLog, Level
from foveacam_server.runtime.store import Store

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


def test_factory_certificate_is_used_when_there_is_nothing_better(events: EventLog, folder: Path) -> None:
    service = CalibrationService(chosen=None, folder=folder, events=events)
    service.choose_for(RIG)
    assert service.require().origin == "factory"
    assert service.problem is None
    assert service.reach_rad is not None


def test_newer_calibration_in_the_data_folder_wins(events: EventLog, folder: Path) -> None:
    factory = load_calibration(FACTORY / f"{RIG}.json")
    newer = replace(factory, label="mine", origin="measured", created_utc="2099-01-01T00:00:00+00:00")
    save_calibration(newer, folder / "mine.json")
    service = CalibrationService(chosen=None, folder=folder, events=events)
    service.choose_for(RIG)
    assert service.require().label == "mine"
    assert [known.label for known in service.every()] == ["mine", factory.label]


def test_before_the_rig_is_open_there_is_none(events: EventLog, folder: Path) -> None:
    service = CalibrationService(chosen=None, folder=folder, events=events)
    with pytest.raises(NotCalibrated, match="not open yet"):
        service.require()


def test_calibration_of_another_rig_is_refused_naming_both(events: EventLog, folder: Path) -> None:
    service = CalibrationService(chosen=FACTORY / "sim-paper.json", folder=folder, events=events)
    service.choose_for(RIG)
    with pytest.raises(NotCalibrated, match=r"sim-paper.*sim-rig120"):
        service.require()
    assert events.recent(1)[0].level is Level.ERROR


def test_rig_without_any_calibration_says_how_to_load_one(events: EventLog, folder: Path) -> None:
    service = CalibrationService(chosen=None, folder=folder, events=events)
    service.choose_for("workshop")
    with pytest.raises(NotCalibrated, match="--calibration FILE"):
        service.require()


def test_damaged_file_in_the_data_folder_is_passed_over(events: EventLog, folder: Path) -> None:
    shutil.copy(FACTORY / f"{RIG}.json", folder / "bad.json")
    (folder / "bad.json").write_text((folder / "bad.json").read_text()[:500])
    service = CalibrationService(chosen=None, folder=folder, events=events)
    service.choose_for(RIG)
    assert len(service.every()) == 1


def test_unknown_id_is_not_found(events: EventLog, folder: Path) -> None:
    service = CalibrationService(chosen=None, folder=folder, events=events)
    with pytest.raises(NotFound):
        service.get("0000")
