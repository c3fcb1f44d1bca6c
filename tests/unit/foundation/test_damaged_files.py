"""Small files of the data directory that are damaged: told in the log, with their names, and done without."""

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from foveacam_pipeline.continuous_loop.settings import LoopSettings
from foveacam_pipeline.storage.archive import read_record
from foveacam_pipeline.storage.disk import write_file
from foveacam_server.foundation.named_documents import NamedDocument, NamedDocuments
from foveacam_server.resources.capturing.recordings.notes import notes_path, read_notes
from foveacam_server.resources.devices.cameras.records import CameraRecords
from foveacam_server.resources.devices.cameras.trigger_tests import TriggerTests
from foveacam_server.resources.devices.rig_setup.service import load_draft
from foveacam_server.resources.looking.clouds.depth_patches import load_patch
from foveacam_server.resources.looking.loop import settings_file
from foveacam_server.rig.settle_times import SettleTimes

DAMAGED = {
    "empty": b"",
    "cut off": b'{"format": "foveacam-',
    "a list": b"[]",
    "nothing in it": b"{}",
    "another version": b'{"format": "foveacam-settle-time", "version": 99}',
    "no text": b"\xff\xfe\x00",
    "deep": b"[" * 100_000,
    "a folder": None,
}


def trigger_tests(folder: Path) -> object:
    unused = cast(Any, SimpleNamespace(handle=lambda *_: None))  # no test is run
    tests = TriggerTests(folder, cameras=unused, hardware=unused, jobs=unused, events=unused)
    return tests.every() or None


READERS: dict[str, tuple[str, Callable[[Path], object]]] = {
    "settle time": ("rig.json", lambda folder: SettleTimes(folder).of("rig")),
    "camera": ("7-7902699b.json", lambda folder: CameraRecords(folder).get("7")),
    "trigger test": ("a.json", trigger_tests),
    "draft": ("draft.json", load_draft),
    "notes": (notes_path(Path("a.fcap")).name, lambda folder: read_notes(folder / "a.fcap")),
    "named": ("a.json", lambda folder: named(folder).every() or None),
    "archived": ("archived.json", lambda folder: read_record(folder / "archived.json")),
}


def named(folder: Path) -> NamedDocuments[NamedDocument]:
    return NamedDocuments(folder, NamedDocument, form="foveacam-test", version=1)


@pytest.mark.parametrize("content", DAMAGED.values(), ids=DAMAGED.keys())
@pytest.mark.parametrize(("name", "read"), READERS.values(), ids=READERS.keys())
def test_a_damaged_file_is_told_once_and_done_without(
    name: str,
    read: Callable[[Path], object],
    content: bytes | None,
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
) -> None:
    damage(tmp_path / name, content)
    assert read(tmp_path) is None
    (told,) = [record.getMessage() for record in caplog.records if record.levelname == "WARNING"]
    assert name.removesuffix(".fcap.json") in told


@pytest.mark.parametrize("content", [b"", b"{", b"[" * 100, None])
def test_damaged_settings_of_the_loop_and_depths_are_told(
    content: bytes | None, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    damage(tmp_path / settings_file.FILE, content)
    damage(tmp_path / "patch.npz", content)
    assert settings_file.load_settings(tmp_path) == LoopSettings()
    assert "the loop begins with its default settings" in caplog.text
    with pytest.raises((OSError, ValueError)):
        load_patch(tmp_path / "patch.npz")


def damage(path: Path, content: bytes | None) -> None:
    if content is None:
        path.mkdir()
    else:
        path.write_bytes(content)


def test_of_a_file_that_cannot_be_written_nothing_is_left(tmp_path: Path) -> None:
    (tmp_path / "kept").mkdir()  # a file cannot take the place of a folder
    with pytest.raises(OSError, match="kept"):
        write_file(tmp_path / "kept", b"0123456789")
    assert [path.name for path in tmp_path.iterdir()] == ["kept"]
