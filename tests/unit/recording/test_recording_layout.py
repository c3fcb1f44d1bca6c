"""The player's arrangement beside a recording: kept, moved with it, and never overwritten unasked."""

import shutil
from pathlib import Path

import pytest
from tests.support.scenes.recordings import record

from foveacam_hardware.contract import InvalidInput
from foveacam_server.resources.capturing.recordings.collection import RecordingCollection, StoredRecording
from foveacam_server.resources.capturing.recordings.layout import (
    LayoutRequest,
    PlayerLayout,
    TrackLayout,
    read_layout,
    write_layout,
)

LAYOUT = PlayerLayout(
    tracks=[TrackLayout(name="left", on=True), TrackLayout(name="center", on=False)],
    panes="row-600(wide,left)",
    stereo="anaglyph",
    style="blue_red",
    boxes=True,
    footprints=False,
    depth=True,
    speed=0.5,
    from_s=0.0,
    to_s=0.1,
)


@pytest.fixture
def shelf(tmp_path: Path) -> RecordingCollection:
    found = RecordingCollection(tmp_path / "recordings")
    record(found.folder / "one.fcap")
    return found


def only(shelf: RecordingCollection) -> StoredRecording:
    (found,) = shelf.every()
    return found


def test_what_was_arranged_is_there_again_also_after_the_trash(shelf: RecordingCollection) -> None:
    assert read_layout(only(shelf)).state == "none"
    write_layout(only(shelf), LayoutRequest(layout=LAYOUT))
    assert (shelf.folder / "one.fcap.ui.json").is_file()

    shelf.remove(only_in_trash := only(shelf))
    shelf.restore(only_in_trash.id)

    found = read_layout(only(shelf))
    assert (found.state, found.layout) == ("kept", LAYOUT)
    write_layout(only(shelf), LayoutRequest(layout=LAYOUT.model_copy(update={"speed": 2.0})))
    faster = read_layout(only(shelf)).layout
    assert faster is not None
    assert faster.speed == 2.0


@pytest.mark.parametrize("content", ["{", '{"version": 9}', '{"tracks": []}', "\x00", "[" * 10_000])
def test_what_cannot_be_read_is_said_and_overwritten_only_when_asked(
    shelf: RecordingCollection, content: str
) -> None:
    sidecar = shelf.folder / "one.fcap.ui.json"
    sidecar.write_text(content)
    found = read_layout(only(shelf))
    assert (found.state, found.layout) == ("unreadable", None)
    assert "one.fcap.ui.json cannot be read" in found.why

    with pytest.raises(InvalidInput, match="overwrite it"):
        write_layout(only(shelf), LayoutRequest(layout=LAYOUT))
    assert sidecar.read_text() == content

    write_layout(only(shelf), LayoutRequest(layout=LAYOUT, replace=True))
    assert read_layout(only(shelf)).state == "kept"


def test_one_of_another_recording_is_not_used(shelf: RecordingCollection) -> None:
    write_layout(only(shelf), LayoutRequest(layout=LAYOUT))
    record(shelf.folder / "two.fcap", ticks=9)
    shutil.copy(shelf.folder / "one.fcap.ui.json", shelf.folder / "two.fcap.ui.json")
    (two,) = [stored for stored in shelf.every() if stored.name == "two"]

    assert read_layout(two).state == "of another recording"
    with pytest.raises(InvalidInput, match="belongs to another recording"):
        write_layout(two, LayoutRequest(layout=LAYOUT))
