import errno
import json
import os
from dataclasses import replace
from pathlib import Path

import pytest
from tests.support.scenes.exchange_rig import Bench

from foveacam_hardware.contract import InvalidInput, NotCalibrated, StorageFull
from foveacam_pipeline.calibrate.sweep.sweep_file import save_sweep
from foveacam_pipeline.calibrate.sweep.sweep_plan import SweepPlan
from foveacam_server.foundation.errors import NotFound
from foveacam_server.resources.calibrating.sessions.descriptions import describe_session
from foveacam_server.resources.calibrating.sessions.pictures import (
    describe_pictures,
    picture_path,
    write_picture,
)
from foveacam_server.resources.calibrating.sessions.schema import ClosingDocument, ClosingEyeDocument
from foveacam_server.resources.calibrating.sessions.sessions import DRIFT, HEAD, VIEWS, SessionCollection
from foveacam_server.resources.calibrating.sessions.wide_stage import lens_of


@pytest.fixture
def shelf(tmp_path: Path) -> SessionCollection:
    return SessionCollection(tmp_path / "sessions")


def test_session_is_found_again_by_its_id(shelf: SessionCollection) -> None:
    made = shelf.create(label="spring", rig_id="rig-1", baseline_m=0.2)
    head = SessionCollection(shelf.folder).get(made.id).head
    assert (head.id, head.label, head.rig_id, head.baseline_m) == (made.id, "spring", "rig-1", 0.2)


def test_calibrations_of_a_session_are_listed_once_newest_last(shelf: SessionCollection) -> None:
    session = shelf.create(label="a", rig_id="rig-1", baseline_m=0.2)
    for calibration_id in ("aa", "bb", "aa"):
        session.add_calibration(calibration_id)
    assert session.head.calibrations == ("bb", "aa")


@pytest.mark.parametrize("wanted", ["ses-0", "..", "../../etc", "ses-zz", ""])
def test_what_is_no_session_is_not_found(shelf: SessionCollection, wanted: str) -> None:
    with pytest.raises(NotFound, match="no calibration session"):
        shelf.get(wanted)


def test_removed_session_is_gone_with_its_files(shelf: SessionCollection) -> None:
    session = shelf.create(label="a", rig_id="rig-1", baseline_m=0.2)
    (session.folder / "fit-result.json").write_text('{"models": []}')
    shelf.remove(session.id)
    assert shelf.every() == []
    assert not session.folder.exists()


@pytest.mark.parametrize("content", ["", "{", "[]", '{"format": "other"}', '{"format": 1, "version": 1}'])
def test_damaged_head_is_passed_over_in_the_list_and_named_when_asked_for(
    shelf: SessionCollection, content: str
) -> None:
    whole = shelf.create(label="whole", rig_id="rig-1", baseline_m=0.2)
    damaged = shelf.create(label="damaged", rig_id="rig-1", baseline_m=0.2)
    (damaged.folder / "session.json").write_text(content)
    assert [session.id for session in shelf.every()] == [whole.id]
    with pytest.raises(InvalidInput, match=r"session\.json"):
        _ = damaged.head


def test_empty_session_says_so_in_every_part(shelf: SessionCollection) -> None:
    session = shelf.create(label="a", rig_id="rig-1", baseline_m=0.2)
    document = describe_session(session, url="/s", running="job-1").as_json()
    assert document["bytes"] > 0
    assert document["running"] == "job-1"
    for part in ("board", "wide", "fit", "settle", "check"):
        assert document[part] is None
    for part in ("sweeps", "pictures", "calibrations", "problems"):
        assert document[part] == []


def test_part_that_cannot_be_read_is_named_and_the_others_are_shown(shelf: SessionCollection) -> None:
    session = shelf.create(label="a", rig_id="rig-1", baseline_m=0.2)
    (session.folder / "fit-result.json").write_text('{"mod')
    (session.folder / "sweep-markers.jsonl").write_text("nonsense\n")
    (session.folder / "settle-result.json").write_text('{"axes": []}')
    (session.folder / "check-result.json").write_text('{"calibration_id": "aa", "poses": "many"}')
    document = describe_session(session, url="/s", running=None).as_json()
    assert document["settle"] == {"axes": [], "applied": False}
    assert document["fit"] is None
    assert document["check"] is None
    assert document["sweeps"] == []
    assert len(document["problems"]) == 3
    assert "fit-result.json" in document["problems"][1]
    assert "check-result.json cannot be read (epipolar_rms_px: " in document["problems"][2]


def test_step_that_needs_the_wide_camera_says_which_step_comes_first(shelf: SessionCollection) -> None:
    session = shelf.create(label="a", rig_id="rig-1", baseline_m=0.2)
    with pytest.raises(NotCalibrated, match="run the step wide first"):
        lens_of(session)


def test_picture_has_another_address_when_it_was_drawn_anew(shelf: SessionCollection) -> None:
    session = shelf.create(label="a", rig_id="rig-1", baseline_m=0.2)
    write_picture(session, "loo", b"first")
    first = describe_pictures(session, url="/s")
    path = picture_path(session, "loo")
    path.write_bytes(b"second")
    os.utime(path, ns=(0, path.stat().st_mtime_ns + 5_000_000))
    second = describe_pictures(session, url="/s")
    assert first[0].name == "loo"
    assert first[0].url.startswith("/s/pictures/loo.png?v=")
    assert first[0].url != second[0].url


def test_picture_that_nobody_draws_is_not_found(shelf: SessionCollection) -> None:
    session = shelf.create(label="a", rig_id="rig-1", baseline_m=0.2)
    with pytest.raises(NotFound, match="there are: none"):
        picture_path(session, "loo")
    with pytest.raises(NotFound):
        picture_path(session, "../session")


def test_files_are_written_whole(shelf: SessionCollection) -> None:
    session = shelf.create(label="a", rig_id="rig-1", baseline_m=0.2)
    eye = ClosingEyeDocument(eye="left", shift_deg=(0.1, 0.2), roll_deg=0.3, moved_px=4.0, sigma_px=0.5)
    drift = ClosingDocument(calibration_id="aa", corrected=True, places=5, eyes=[eye], rows_px=1.5, detail="")
    session.write(DRIFT, drift)
    with pytest.raises(ValueError, match="JSON"):
        session.write(DRIFT, drift.model_copy(update={"rows_px": float("nan")}))
    assert json.loads((session.folder / "drift-result.json").read_text())["rows_px"] == 1.5
    assert session.read(DRIFT) == drift


def test_sessions_are_put_together_with_the_newest_lens(shelf: SessionCollection) -> None:
    made = [shelf.create(label=name, rig_id="lab-1", baseline_m=0.2) for name in ("old", "mid", "new")]
    sweep = Bench(plan=SweepPlan(columns=3, rows=3)).sweep()
    for number, (session, utc) in enumerate(zip(made, ("2020", "2021", "2022"), strict=True)):
        session.write(HEAD, session.head.model_copy(update={"created_utc": utc}))
        save_sweep(
            replace(sweep, header=replace(sweep.header, created_utc=f"{utc}-01-01T00:00:00Z")),
            session.folder / "sweep-markers.jsonl",
        )
        if number < 2:
            (session.folder / VIEWS).write_text(session.head.label)
    combined = shelf.combine([session.id for session in made])
    assert combined.head.label == "combined from 3 sweeps of 27 poses"
    assert (combined.head.rig_id, (combined.folder / VIEWS).read_text()) == ("lab-1", "mid")
    assert len(list(combined.folder.glob("sweep-*.jsonl"))) == 3
    assert shelf.every()[0].id == combined.id


def test_what_cannot_be_put_together_is_refused_by_name(shelf: SessionCollection) -> None:
    one = shelf.create(label="one", rig_id="lab-1", baseline_m=0.2)
    other = shelf.create(label="other", rig_id="lab-1", baseline_m=0.2)
    with pytest.raises(InvalidInput, match="1 session was given to be put together; name two or more"):
        shelf.combine([one.id, one.id])
    with pytest.raises(NotFound, match="no calibration session ses-0"):
        shelf.combine([one.id, "ses-0"])
    with pytest.raises(InvalidInput, match="no sweep was given to put together"):
        shelf.combine([one.id, other.id])
    assert len(shelf.every()) == 2


def full(path: Path, content: object, **_mode: int) -> None:
    raise OSError(errno.ENOSPC, "No space left on device", str(path))


def test_session_that_a_full_disk_does_not_take_leaves_no_folder(
    shelf: SessionCollection, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("foveacam_pipeline.storage.disk.write_part", full)
    with pytest.raises(StorageFull, match=r"session\.json of calibration session .* the disk is full"):
        shelf.create(label="a", rig_id="rig-1", baseline_m=0.2)
    assert list(shelf.folder.iterdir()) == []


def test_sessions_that_a_full_disk_cannot_hold_together_leave_no_folder(
    shelf: SessionCollection, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = [shelf.create(label=name, rig_id="lab-1", baseline_m=0.2) for name in ("first", "second")]
    for session in made:
        save_sweep(Bench(plan=SweepPlan(columns=3, rows=3)).sweep(), session.folder / "sweep-markers.jsonl")
        (session.folder / VIEWS).write_text(session.head.label)
    before = sorted(path.name for path in shelf.folder.iterdir())
    monkeypatch.setattr("foveacam_pipeline.storage.disk.write_part", full)  # the very last file
    with pytest.raises(StorageFull, match="the disk is full"):
        shelf.combine([session.id for session in made])
    assert sorted(path.name for path in shelf.folder.iterdir()) == before
