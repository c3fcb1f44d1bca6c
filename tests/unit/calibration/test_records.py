"""The folder of calibrations: named by content, listed, combined, and never written over."""

from dataclasses import replace
from pathlib import Path

import pytest

from foveacam_hardware.contract import InvalidInput, NotCalibrated
from foveacam_pipeline.calibrate.records.records import CalibrationStore
from foveacam_pipeline.models import Calibration, load_calibration
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED

CERTIFICATE = load_calibration(SHIPPED / "sim-rig120.json")
OTHER_RIG = load_calibration(SHIPPED / "sim-paper.json")
CORRECTED = replace(
    CERTIFICATE,
    origin="corrected",
    label="after the move",
    parent_id=CERTIFICATE.id,
    created_utc="2099-01-01T00:00:00+00:00",
)


@pytest.fixture
def store(tmp_path: Path) -> CalibrationStore:
    return CalibrationStore(tmp_path / "calibrations")


def ids(calibrations: tuple[Calibration, ...]) -> list[str]:
    return [calibration.id for calibration in calibrations]


def test_a_calibration_lies_under_its_id(store: CalibrationStore) -> None:
    path = store.add(CERTIFICATE)
    assert path.name == f"{CERTIFICATE.id}.json"
    assert store.get(CERTIFICATE.id).id == CERTIFICATE.id
    assert store.get(CERTIFICATE.id[:6]).label == CERTIFICATE.label


def test_keeping_it_twice_changes_nothing(store: CalibrationStore) -> None:
    path = store.add(CERTIFICATE)
    before = path.stat()
    store.add(CERTIFICATE)
    assert path.stat().st_mtime_ns == before.st_mtime_ns
    assert [entry.name for entry in path.parent.iterdir()] == [path.name]


def test_a_damaged_file_is_never_written_over(store: CalibrationStore) -> None:
    path = store.add(CERTIFICATE)
    path.write_text("damaged", encoding="utf-8")
    with pytest.raises(InvalidInput, match="nothing was overwritten"):
        store.add(CERTIFICATE)
    assert path.read_text(encoding="utf-8") == "damaged"


def test_newest_first_and_what_was_refused_with_the_reason(store: CalibrationStore) -> None:
    store.add(CERTIFICATE)
    store.add(CORRECTED)
    whole = store.path_of(CERTIFICATE.id).read_text(encoding="utf-8")
    store.path_of("cut").write_text(whole[:1000], encoding="utf-8")
    store.path_of("renamed").write_text(whole, encoding="utf-8")
    listing = store.every()
    assert ids(listing.calibrations) == [CORRECTED.id, CERTIFICATE.id]
    reasons = {refusal.path.stem: refusal.reason for refusal in listing.refusals}
    assert "cannot be read as JSON" in reasons["cut"]
    assert f"holds calibration {CERTIFICATE.id}, which is not its name" in reasons["renamed"]


def test_another_rig_s_calibrations_are_passed_over(store: CalibrationStore) -> None:
    store.add(CERTIFICATE)
    store.add(OTHER_RIG)
    listing = store.every(rig_id=CERTIFICATE.rig_id)
    assert ids(listing.calibrations) == [CERTIFICATE.id]
    assert "belongs to rig 'sim-paper'" in listing.refusals[0].reason


def test_an_empty_folder_lists_nothing(store: CalibrationStore) -> None:
    assert store.every().calibrations == ()
    with pytest.raises(NotCalibrated, match=r"'abc': none in .*; list the calibrations"):
        store.get("abc")


def test_the_beginning_of_several_ids_names_none(store: CalibrationStore) -> None:
    store.add(CERTIFICATE)
    store.add(CORRECTED)
    with pytest.raises(NotCalibrated, match="''"):
        store.get("")
