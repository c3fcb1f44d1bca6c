"""Recordings of a data directory: found, removed, restored; those cut off or damaged are said to be so."""

import errno
from pathlib import Path

import pytest
from tests.support.scenes.recordings import record

from foveacam_hardware.contract import InvalidInput
from foveacam_server.foundation.errors import NotFound
from foveacam_server.resources.capturing.recordings.collection import RecordingCollection
from foveacam_server.resources.capturing.recordings.documents import recording_document
from foveacam_server.resources.capturing.recordings.notes import RecordingNotes, notes_path, write_notes
from foveacam_server.resources.capturing.recordings.opened import KEPT, OpenRecordings


@pytest.fixture
def shelf(tmp_path: Path) -> RecordingCollection:
    found = RecordingCollection(tmp_path / "recordings")
    record(found.folder / "one.fcap")
    write_notes(found.folder / "one.fcap", RecordingNotes(id="rec-1", label="first"))
    return found


def test_a_name_is_taken_once_whatever_its_case_or_suffix(shelf: RecordingCollection) -> None:
    (shelf.folder / "two.fovea").write_bytes(b"")
    for taken in ("ONE", "two"):
        with pytest.raises(InvalidInput, match="already"):
            shelf.new_file(taken)
    assert shelf.new_file("three").name == "three.fcap"


def test_a_complete_recording_tells_what_its_recorder_counted(shelf: RecordingCollection) -> None:
    found = recording_document(shelf.get("rec-1"))

    assert (found.state, found.label, found.playable) == ("complete", "first", True)
    assert found.duration_s == pytest.approx(0.1)
    for stream in found.streams:
        assert (stream.published, stream.written, stream.dropped) == (6, 6, 0)


def test_one_that_was_cut_off_says_so_and_keeps_its_whole_frames(shelf: RecordingCollection) -> None:
    path = shelf.folder / "one.fcap"
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])

    found = recording_document(shelf.get("rec-1"))

    assert (found.state, found.playable) == ("truncated", True)
    assert found.truncated is not None
    assert found.truncated.lost_bytes > 0
    assert "ends before its recording does" in found.why
    assert 0 < sum(stream.frames for stream in found.streams) < 18


def test_a_file_that_somebody_put_there_is_found_and_one_that_is_none_is_damaged(
    shelf: RecordingCollection,
) -> None:
    record(shelf.folder / "brought.fcap", streams=("center",))
    (shelf.folder / "bad.fcap").write_text("nothing")
    found = {kept.name: recording_document(kept) for kept in shelf.every()}

    assert found["brought"].id == shelf.get(found["brought"].id).id
    assert [(stream.name, stream.role) for stream in found["brought"].streams] == [("center", "wide")]
    assert (found["bad"].state, found["bad"].playable) == ("damaged", False)
    assert "does not begin as an MCAP file" in found["bad"].why


def test_notes_that_cannot_be_read_lose_no_picture(shelf: RecordingCollection) -> None:
    notes_path(shelf.folder / "one.fcap").write_text("{")
    (kept,) = shelf.every()

    assert recording_document(kept).state == "complete"


def test_what_is_removed_can_be_restored_beside_its_successor(shelf: RecordingCollection) -> None:
    shelf.remove(shelf.get("rec-1"))
    assert shelf.every() == []
    with pytest.raises(NotFound):
        shelf.get("rec-1")
    record(shelf.folder / "one.fcap")

    restored = shelf.restore("rec-1")

    assert (restored.path.name, restored.notes.label) == ("one (2).fcap", "first")
    assert shelf.trash() == []
    shelf.remove(restored)
    assert shelf.empty_trash() == 1
    assert shelf.trash() == []


def test_recordings_stay_open_while_they_are_looked_at_and_the_oldest_is_closed(tmp_path: Path) -> None:
    opened = OpenRecordings()
    paths = [tmp_path / f"{number}.fcap" for number in range(KEPT + 1)]
    for path in paths:
        record(path, ticks=1)
    with opened.reading(paths[0]) as first:
        assert len(first.streams) == 3
    with opened.reading(paths[0]) as again:
        assert again is first
    for path in paths[1:]:
        with opened.reading(path) as other:
            assert len(other.frame("left", 0).image) == 24
    with opened.reading(paths[0]) as anew:
        assert anew is not first
        assert len(anew.frame("left", 0).image) == 24
    opened.forget(paths[0])
    with opened.reading(paths[0]) as again:
        assert again is not anew
    opened.close()


def test_a_recording_goes_to_the_trash_of_a_full_disk_and_comes_back(
    shelf: RecordingCollection, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(path: Path, content: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device", str(path))

    monkeypatch.setattr("foveacam_pipeline.storage.disk.write_part", full)
    shelf.remove(shelf.get("rec-1"))
    assert [kept.id for kept in shelf.trash()] == ["rec-1"]
    assert shelf.restore("rec-1").notes.label == "first"


def test_a_numbered_name_gets_the_number_after_the_highest(shelf: RecordingCollection) -> None:
    assert shelf.new_file("walk", numbered=True).stem == "walk 0001"
    assert shelf.new_file("", numbered=True).stem == "0001"
    for used in ("Walk 0007.fcap", "walk 12.fcap", "walking 0009.fcap", "0041.fovea"):
        (shelf.folder / used).write_bytes(b"")
    assert shelf.new_file("walk", numbered=True).stem == "walk 0008"
    assert shelf.new_file("", numbered=True).stem == "0042"
    with pytest.raises(InvalidInput):
        shelf.new_file("../up", numbered=True)
