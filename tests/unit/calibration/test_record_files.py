"""Calibrations as files: ours to the bit, the authors' bundle with its poses, and what is refused."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from tests.support.scenes.swept_rig import swept

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.calibrate.sweep.sweep import sweep_filename
from foveacam_pipeline.calibrate.sweep.sweep_file import save_sweep
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.calibration_file import load_calibration
from foveacam_server.resources.calibrating.calibrations.record_files import (
    ImportFacts,
    calibration_of,
    export_bytes,
    known_format,
)
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED
from foveacam_server.resources.calibrating.sessions.descriptions import SessionReader
from foveacam_server.resources.calibrating.sessions.sessions import SessionCollection

SEED = 5


@pytest.fixture
def shelf(tmp_path: Path) -> SessionCollection:
    return SessionCollection(tmp_path / "sessions")


@pytest.fixture
def measured(shelf: SessionCollection) -> Calibration:
    """A calibration whose session holds the sweep of seven by seven poses."""
    sweep = swept(SEED, 5.0, side=7)
    rig_id = sweep.header.rig_id
    session = shelf.create(label="spring", rig_id=rig_id, baseline_m=0.2)
    save_sweep(sweep, session.folder / sweep_filename(sweep.header.station))
    shipped = load_calibration(SHIPPED / "sim-rig120.json")
    return replace(shipped, rig_id=rig_id, session_id=session.id, origin="measured")


def test_our_file_comes_back_the_same(measured: Calibration, shelf: SessionCollection) -> None:
    document = json.loads(export_bytes(measured, "foveacam", sessions=SessionReader(shelf)))
    assert calibration_of(document, ImportFacts(rig_id=measured.rig_id)).id == measured.id


def test_authors_bundle_carries_the_poses_and_can_be_fitted_again(
    measured: Calibration, shelf: SessionCollection
) -> None:
    document = json.loads(export_bytes(measured, "authors", sessions=SessionReader(shelf)))
    assert document["schema"] == "fovea-device-config@1"
    assert len(document["records"]) == 3
    found = calibration_of(document, ImportFacts(rig_id=measured.rig_id, distance_m=5.0))
    assert found.origin == "imported"
    assert found.rig_id == measured.rig_id
    assert max(found.left.mirror.loo_rad) < 2e-3  # a cubic's 0.1 degrees: the poses were read rightly


def test_bundle_without_a_session_is_refused(measured: Calibration, shelf: SessionCollection) -> None:
    with pytest.raises(InvalidInput, match="not kept here"):
        export_bytes(replace(measured, session_id=None), "authors", sessions=SessionReader(shelf))
    with pytest.raises(InvalidInput, match="not kept here"):
        export_bytes(replace(measured, session_id="ses-0"), "authors", sessions=SessionReader(shelf))


@pytest.mark.parametrize("document", [None, [], "text", {}, {"schema": "other@1"}, {"format": "other"}])
def test_what_is_no_calibration_is_refused(document: object) -> None:
    with pytest.raises(InvalidInput, match="import"):
        calibration_of(document, ImportFacts(rig_id="rig-1"))


def test_bundle_that_lacks_a_record_is_refused(measured: Calibration, shelf: SessionCollection) -> None:
    document = json.loads(export_bytes(measured, "authors", sessions=SessionReader(shelf)))
    document["records"] = document["records"][:2]
    with pytest.raises(InvalidInput, match="right"):
        calibration_of(document, ImportFacts(rig_id=measured.rig_id, distance_m=5.0))


def test_bundle_of_another_wide_camera_is_refused_naming_both_sizes(
    measured: Calibration, shelf: SessionCollection
) -> None:
    document = json.loads(export_bytes(measured, "authors", sessions=SessionReader(shelf)))
    facts = ImportFacts(rig_id=measured.rig_id, distance_m=5.0, wide_size=(1920, 1200))
    with pytest.raises(InvalidInput, match="1440 × 1080 px, this rig's has 1920 × 1200 px"):
        calibration_of(document, facts)


def test_unknown_format_is_refused_with_those_there_are() -> None:
    with pytest.raises(InvalidInput, match="foveacam and authors"):
        known_format("xml")
