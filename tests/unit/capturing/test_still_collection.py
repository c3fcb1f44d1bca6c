"""Stills of a data directory: held, kept, discarded; what a killed program left is cleared away."""

from pathlib import Path

import pytest
from tests.support.scenes.dataset_scenes import header, written

from foveacam_hardware.contract import Busy, InvalidInput, Role
from foveacam_pipeline.capture.dataset import DatasetWriter, check_dataset
from foveacam_server.datasets.collection import point_of
from foveacam_server.foundation.errors import NotFound
from foveacam_server.resources.capturing.stills.cli_run import StillOrder
from foveacam_server.resources.capturing.stills.collection import (
    MOST_HELD,
    StillCollection,
    StillState,
    StoredStill,
)
from foveacam_server.resources.capturing.stills.schema import StillDocument


@pytest.fixture
def shelf(tmp_path: Path) -> StillCollection:
    """A shelf with one still that is held."""
    found = StillCollection(tmp_path / "stills")
    written(found.new_folder("one"), 1)
    return found


def names(shelf: StillCollection, state: StillState) -> list[str]:
    return [found.stored.name for found in shelf.every(state)]


def test_a_still_is_held_until_it_is_kept(shelf: StillCollection) -> None:
    assert shelf.get("test").state is StillState.HELD

    kept = shelf.keep("test", name="the desk")

    assert (kept.state, kept.stored.folder) == (StillState.KEPT, shelf.folder / "the desk")
    assert check_dataset(kept.stored.folder) == []
    assert names(shelf, StillState.HELD) == []
    with pytest.raises(InvalidInput, match="kept already"):
        shelf.keep("test")


def test_one_that_is_kept_while_it_is_read_is_read_again(shelf: StillCollection) -> None:
    folders: list[Path] = []

    def read(found: StoredStill) -> int:
        folders.append(found.stored.folder)
        if len(folders) == 1:
            shelf.keep("test")
        return len(point_of(found.stored, 0).stacked(Role.WIDE).image)

    assert shelf.read("test", read) > 0
    assert folders == [shelf.folder / ".held" / "one", shelf.folder / "one"]

    (shelf.folder / "one" / "images").rename(shelf.folder / "elsewhere")
    with pytest.raises(InvalidInput, match="cannot be read"):
        shelf.read("test", read)


def test_one_that_was_discarded_can_be_had_back(shelf: StillCollection) -> None:
    shelf.remove("test")
    with pytest.raises(NotFound):
        shelf.get("test")
    assert names(shelf, StillState.REMOVED) == ["one"]

    assert shelf.restore("test").state is StillState.KEPT
    assert names(shelf, StillState.KEPT) == ["one"]


def test_a_name_is_taken_whether_its_still_is_held_or_kept(shelf: StillCollection) -> None:
    with pytest.raises(InvalidInput, match="already"):
        shelf.new_folder("ONE")
    shelf.keep("test")
    with pytest.raises(InvalidInput, match="already"):
        shelf.new_folder("One")


def test_stills_without_a_name_are_called_by_the_moment(shelf: StillCollection) -> None:
    first = shelf.new_folder(None)
    first.mkdir()

    assert first.name.startswith("still 20")
    assert shelf.new_folder(None) != first


def test_no_more_are_taken_while_many_wait_to_be_looked_at(shelf: StillCollection) -> None:
    for number in range(MOST_HELD - 1):
        shelf.new_folder(f"another {number}").mkdir()
    with pytest.raises(Busy, match="keep or discard some first"):
        shelf.new_folder("too many")

    assert shelf.new_folder("kept at once", waits=False).name == "kept at once"


def test_what_a_killed_program_had_begun_is_cleared_away(shelf: StillCollection) -> None:
    with DatasetWriter.create(shelf.new_folder("begun"), header(1)) as writer:
        writer.close("killed")
    assert "begun" in names(shelf, StillState.HELD)

    assert names(StillCollection(shelf.folder), StillState.HELD) == ["one"]


def test_one_that_cannot_be_read_is_listed_with_the_reason(shelf: StillCollection) -> None:
    found = shelf.keep("test")
    (found.stored.folder / "dataset.json").write_text('{"format": "foveacam-dataset", "version": 99}')

    still = StillDocument.of(shelf.every(StillState.KEPT)[0])

    assert (still.name, still.cameras) == ("one", [])
    assert "newer" in still.trouble


def test_options_that_mean_no_still_are_refused_in_words() -> None:
    usual = {"name": None, "frames": 5, "every_frame": False, "cameras": None, "label": "", "codec": "png"}
    assert StillOrder.checked(**usual).request().cameras == ("wide", "left", "right")  # type: ignore[arg-type]  # of options
    for change, told in (
        ({"cameras": ["middle"]}, "wide, left and right"),
        ({"codec": "jpg"}, "png or tiff"),
    ):
        with pytest.raises(InvalidInput, match=told):
            StillOrder.checked(**{**usual, **change})  # type: ignore[arg-type]  # of options
