"""Captures of a data directory: found, removed, restored; damaged and interrupted ones are said to be so."""

import io
import shutil
import zipfile
from pathlib import Path

import pytest
from tests.support.scenes.dataset_scenes import written

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.capture.dataset import DatasetState, labels
from foveacam_pipeline.capture.dataset.document import read_document, write_document
from foveacam_server.datasets.collection import DatasetCollection, point_of
from foveacam_server.datasets.download import zip_stream
from foveacam_server.foundation.errors import NotFound
from foveacam_server.resources.capturing.captures.cli_order import plan_of
from foveacam_server.resources.capturing.captures.schema import CaptureDocument, PointsDocument


@pytest.fixture
def shelf(tmp_path: Path) -> DatasetCollection:
    found = DatasetCollection(tmp_path / "captures")
    written(found.folder / "one", 2)
    return found


def test_a_name_is_taken_once_whatever_its_case(shelf: DatasetCollection) -> None:
    with pytest.raises(InvalidInput, match="already"):
        shelf.new_folder("ONE")
    assert shelf.new_folder("two").name == "two"


def test_a_name_that_the_file_system_cannot_hold_is_refused_before_anything_is_made(
    shelf: DatasetCollection, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(labels, "LONGEST_NAME", 1000)
    monkeypatch.setattr(labels, "LONGEST_NAME_BYTES", 1000)
    with pytest.raises(InvalidInput, match="File name too long"):
        shelf.new_folder("x" * 300)
    monkeypatch.setattr(labels, "LONGEST_NAME_BYTES", 90)
    with pytest.raises(InvalidInput, match="longer than 90 bytes"):
        shelf.new_folder("木" * 31)
    assert [path.name for path in shelf.folder.iterdir()] == ["one"]


def test_what_is_removed_can_be_restored_beside_its_successor(shelf: DatasetCollection) -> None:
    shelf.remove("test")
    assert shelf.every() == []
    with pytest.raises(NotFound):
        shelf.get("test")
    (shelf.folder / "one").mkdir()

    assert shelf.restore("test").name == "one (2)"
    assert shelf.trash() == []


def test_an_emptied_trash_is_gone(shelf: DatasetCollection) -> None:
    shelf.remove("test")
    assert shelf.empty_trash() == 1
    assert shelf.trash() == []


def test_a_capture_whose_program_was_killed_is_partial_and_can_go_on(shelf: DatasetCollection) -> None:
    folder = shelf.folder / "one"
    write_document(folder, read_document(folder).with_state(DatasetState.RUNNING))

    found = CaptureDocument.of(shelf.get("test"))

    assert (found.state, found.resumable) == ("partial", True)
    assert "interrupted" in found.why


def test_a_damaged_capture_is_listed_with_the_reason(shelf: DatasetCollection) -> None:
    (shelf.folder / "one" / "dataset.json").write_text('{"format": "foveacam-dataset", "version": 99}')

    found = CaptureDocument.of(shelf.every()[0])

    assert (found.name, found.state, found.resumable) == ("one", "damaged", False)
    assert "newer" in found.why


def test_a_download_holds_every_file_but_the_lock(shelf: DatasetCollection) -> None:
    folder = shelf.folder / "one"
    archive = zipfile.ZipFile(io.BytesIO(b"".join(zip_stream(folder))))

    files = {path.relative_to(shelf.folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    assert set(archive.namelist()) == files - {"one/.lock"}
    assert archive.testzip() is None


def test_a_plan_of_the_command_line_is_a_file_or_options_or_none(tmp_path: Path) -> None:
    text = tmp_path / "points.txt"
    text.write_text("0, 0\n1, 2, inf\n")
    grid = plan_of(None, {"points": {"columns": 3}, "stack_frames": 2})

    assert grid is not None
    assert (grid.points_per_scan, grid.stack_frames) == (27, 2)
    by_text = plan_of(text, {})
    assert by_text is not None
    assert by_text.points_per_scan == 2
    assert plan_of(None, {}, begun="--resume") is None
    for path, options, begun, told in (
        (text, {"stack_frames": 2}, None, "options of one too"),
        (text, {}, "--watch", "--watch: a capture has its own plan"),
        (tmp_path / "none.json", {}, None, "cannot be read"),
    ):
        with pytest.raises(InvalidInput, match=told):
            plan_of(path, options, begun=begun)


def test_the_points_of_a_capture_stand_on_the_sheet_where_they_are_drawn(shelf: DatasetCollection) -> None:
    dataset = written(shelf.folder / "three", 3)

    found = PointsDocument.of(dataset)

    assert (found.rows, found.columns, found.skipped) == (2, 2, [])
    assert [(point.sheet_row, point.sheet_column) for point in found.points] == [(0, 0), (0, 1), (1, 0)]
    assert found.points[0].cameras == ["left", "right", "wide"]
    assert found.points[0].aim_ax_deg == pytest.approx(5.7296, abs=1e-3)


def test_a_point_that_was_not_taken_is_refused_with_what_there_is(shelf: DatasetCollection) -> None:
    with pytest.raises(InvalidInput, match="point 7 was asked for, it has 2 points of 2"):
        point_of(shelf.get("test"), 7)


def test_a_copy_of_a_folder_is_another_capture_that_can_be_removed_and_restored(
    shelf: DatasetCollection,
) -> None:
    shutil.copytree(shelf.folder / "one", shelf.folder / "one #2")
    assert [(kept.id, kept.name) for kept in shelf.every()] == [("test", "one"), ("one #2", "one #2")]
    assert CaptureDocument.of(shelf.get("one #2")).url.endswith("/captures/one%20%232")

    shelf.remove("one #2")
    assert [kept.name for kept in shelf.every()] == ["one"]
    assert [kept.id for kept in shelf.trash()] == ["one #2"]

    assert shelf.restore("one #2").name == "one #2"


def test_a_damaged_capture_is_restored_beside_its_successor(shelf: DatasetCollection) -> None:
    (shelf.folder / "one" / "dataset.json").write_text("{}")
    shelf.remove("one")
    (shelf.folder / "one").mkdir()

    assert shelf.restore("one").name == "one (2)"
