"""Recordings from elsewhere: sent in parts, checked as they come, or opened where they lie."""

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from tests.support.scenes.recordings import record

from foveacam_hardware.contract import Busy, InvalidInput, OutOfRange, StorageFull
from foveacam_pipeline.storage.free_space import RESERVE_BYTES
from foveacam_server.foundation.errors import NotFound, PersonLimit
from foveacam_server.foundation.persons.person_quota import PERSON
from foveacam_server.resources.capturing.recordings.collection import RecordingCollection, StoredRecording
from foveacam_server.resources.capturing.recordings.documents import recording_document
from foveacam_server.resources.capturing.recordings.imports import uploads
from foveacam_server.resources.capturing.recordings.imports.schema import (
    LARGEST_BYTES,
    OpenRequest,
    UploadDocument,
    UploadRequest,
)
from foveacam_server.resources.capturing.recordings.imports.service import ImportService

from .test_recording_others import written


class Imports:
    """The imports of a data directory, with a second folder, on a disk of `free_bytes`."""

    def __init__(self, home: Path) -> None:
        self.home = home
        self.free_bytes = 1 << 40
        self.added: list[StoredRecording] = []
        self.collection = RecordingCollection(home / "data" / "recordings")
        (home / "disk" / "june").mkdir(parents=True)
        self.service = ImportService(
            self.collection,
            folders=[home / "disk"],
            free_bytes=lambda _: self.free_bytes,
            report=self.added.append,
        )

    def begin(self, name: str, size_bytes: int) -> UploadDocument:
        return self.service.begin(UploadRequest(name=name, size_bytes=size_bytes))

    def send(self, upload: UploadDocument, content: bytes, *, at: int = 0) -> UploadDocument:
        async def parts() -> AsyncIterator[bytes]:
            for begin in range(0, len(content), 1000):
                yield content[begin : begin + 1000]

        return asyncio.run(self.service.add(upload.id, at=at, parts=parts()))

    def upload(self, name: str, content: bytes) -> UploadDocument:
        return self.send(self.begin(name, len(content)), content)

    @property
    def left_over(self) -> list[Path]:
        return list((self.collection.folder / ".uploads").glob("*"))


@pytest.fixture
def imports(tmp_path: Path) -> Imports:
    return Imports(tmp_path)


@pytest.fixture(scope="module")
def content(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("sent") / "a.fcap"
    record(path)
    return path.read_bytes()


def test_a_recording_comes_in_parts_and_is_one_of_the_recordings(imports: Imports, content: bytes) -> None:
    upload = imports.begin("from the lab", len(content))
    half = len(content) // 2
    on_its_way = imports.send(upload, content[:half])
    assert (on_its_way.received_bytes, on_its_way.recording) == (half, None)
    with pytest.raises(InvalidInput, match=f"begins at byte {half}, not 0"):
        imports.send(upload, content)

    sent = imports.send(upload, content[half:], at=half)

    assert sent.recording is not None
    assert (sent.recording.name, sent.recording.state) == ("from the lab", "complete")
    assert sent.recording.created_utc == "2026-01-31T12:00:00+00:00"
    assert (imports.collection.folder / "from the lab.fcap").read_bytes() == content
    assert [stored.id for stored in imports.added] == [sent.recording.id]
    assert imports.left_over == []


def test_one_of_the_authors_and_one_that_is_cut_off_are_taken(imports: Imports, content: bytes) -> None:
    theirs = imports.upload("theirs", written()).recording
    cut = imports.upload("cut", content[: len(content) // 2]).recording

    assert theirs is not None and cut is not None
    assert [stream.name for stream in theirs.streams] == ["left-fovea"]
    assert (cut.state, cut.playable) == ("truncated", True)
    assert "ends before its recording does" in cut.why


@pytest.mark.parametrize(
    ("sent", "found"),
    [
        (b"%PDF-1.7 and so on", 'the text "%PDF-1.7 and"'),
        (b"\x00\x01\x02\x03\x04\x05\x06\x07\x08", "the bytes 00 01 02 03 04 05 06 07"),
    ],
)
def test_what_is_no_recording_is_refused_with_what_was_found(
    imports: Imports, sent: bytes, found: str
) -> None:
    upload = imports.begin("no recording", 10**9)
    with pytest.raises(InvalidInput, match="this is no recording") as refused:
        imports.send(upload, sent)  # the first part is enough
    assert found in (refused.value.found or "")
    assert imports.left_over == []
    with pytest.raises(NotFound):
        imports.service.upload(upload.id)


def test_one_without_frames_is_refused_with_its_channels(imports: Imports) -> None:
    with pytest.raises(InvalidInput, match="left-fovea, telemetry"):
        imports.upload("empty", written(ticks=0))
    assert imports.collection.every() == []
    assert imports.left_over == []


def test_a_used_name_a_full_disk_and_too_much_are_refused_before_anything_is_sent(
    imports: Imports, content: bytes
) -> None:
    imports.upload("one", content)
    imports.begin("two", 1000)
    with pytest.raises(InvalidInput, match="already"):
        imports.begin("One", 1000)
    with pytest.raises(Busy, match="being sent already"):
        imports.begin("TWO", 1000)
    with pytest.raises(OutOfRange, match="256 GiB"):
        imports.begin("three", LARGEST_BYTES + 1)
    imports.free_bytes = RESERVE_BYTES + 999
    with pytest.raises(StorageFull, match="free some"):
        imports.begin("three", 1000)


def test_more_than_was_announced_is_refused_and_an_abandoned_upload_leaves_nothing(
    imports: Imports, content: bytes
) -> None:
    upload = imports.begin("short", len(content) - 1)
    with pytest.raises(InvalidInput, match="announced"):
        imports.send(upload, content)
    assert imports.service.upload(upload.id).received_bytes == 0

    imports.service.abandon(upload.id)

    assert imports.left_over == []
    assert imports.begin("short", 1000).received_bytes == 0


def test_one_whose_page_was_closed_makes_way_for_the_next_of_its_name(
    imports: Imports, content: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    imports.send(imports.begin("walk", len(content)), content[:1000])
    monkeypatch.setattr(uploads, "LEFT_S", -1.0)
    again = imports.upload("walk", content)

    assert again.recording is not None
    assert imports.left_over == []


def test_uploads_of_an_earlier_server_are_removed(imports: Imports, content: bytes) -> None:
    imports.send(imports.begin("left", len(content)), content[:1000])
    assert len(imports.left_over) == 1

    again = ImportService(
        RecordingCollection(imports.home / "data" / "recordings"),
        folders=[],
        free_bytes=lambda _: 1 << 40,
        report=imports.added.append,
    )

    assert list((imports.home / "data" / "recordings" / ".uploads").glob("*")) == []
    assert again.begin(UploadRequest(name="left", size_bytes=1000)).received_bytes == 0


def test_a_recording_of_a_folder_is_opened_where_it_lies(imports: Imports) -> None:
    there = imports.home / "disk" / "june" / "walk.fcap"
    record(there)
    (imports.home / "disk" / "notes.txt").write_text("no recording")
    listed = imports.service.folders()
    assert [(file.name, file.opened) for file in listed.files] == [("walk", False)]
    assert [folder.found for folder in listed.folders] == [False, True]

    opened = imports.service.open(OpenRequest(path=str(there)))

    assert (opened.name, opened.state, opened.size_bytes) == ("walk", "complete", there.stat().st_size)
    assert imports.service.folders().files[0].opened
    stored = imports.collection.get(opened.id)
    imports.collection.remove(stored)
    imports.collection.restore(opened.id)
    imports.collection.remove(imports.collection.get(opened.id))
    assert imports.collection.empty_trash() == 1
    assert there.exists()


def test_a_recording_whose_folder_is_gone_says_so(imports: Imports) -> None:
    there = imports.home / "disk" / "walk.fcap"
    record(there)
    opened = imports.service.open(OpenRequest(path=str(there), name="a walk"))
    there.unlink()

    found = recording_document(imports.collection.get(opened.id))

    assert (found.name, found.state) == ("a walk", "damaged")
    assert "no such file" in found.why


@pytest.mark.parametrize(
    "path",
    [
        "/etc/passwd",
        "../recordings/one.fcap",
        "link.fcap",
        "away/secret.fcap",
        "none.fcap",
        "notes.txt",
        "\0",
    ],
)
def test_nothing_else_of_the_machine_is_opened(imports: Imports, path: str) -> None:
    outside, inside = imports.home / "secret", imports.home / "data" / "import"
    outside.mkdir()
    inside.mkdir()
    record(outside / "secret.fcap")
    (inside / "link.fcap").symlink_to(outside / "secret.fcap")
    (inside / "away").symlink_to(outside)
    (inside / "notes.txt").write_text("no recording")

    with pytest.raises(InvalidInput, match="open: "):
        imports.service.open(OpenRequest(path=path))
    assert imports.collection.every() == []
    assert imports.service.folders().files == []


def test_one_person_has_few_uploads_on_their_way(imports: Imports, content: bytes) -> None:
    before = PERSON.set("mia")
    first = imports.begin("first", len(content))
    others = [imports.begin(f"other {number}", 1000) for number in range(uploads.MOST_OPEN_EACH - 1)]
    with pytest.raises(PersonLimit, match=f"you hold {uploads.MOST_OPEN_EACH} uploads"):
        imports.begin("one more", 1000)
    imports.send(first, content)
    imports.service.abandon(others[0].id)
    for name in ("after the first", "after the other"):
        imports.begin(name, 1000)
    with pytest.raises(PersonLimit):
        imports.begin("one more", 1000)
    PERSON.set("ben")
    imports.begin("of another", 1000)
    PERSON.reset(before)
