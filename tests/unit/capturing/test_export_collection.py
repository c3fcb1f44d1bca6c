"""Exports on the disk: whole ones are listed, unfinished ones are not and are removed at the next start."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from foveacam_server.cli import app
from foveacam_server.datasets.export_format import ExportFormat
from foveacam_server.foundation.errors import NotFound
from foveacam_server.resources.capturing.exports.collection import (
    MADE,
    ExportCollection,
    ExportRecord,
    write_record,
)

STRANGE_ID = "../nowhere"
"""The id of a copy is the name of its folder."""


def make(exports: ExportCollection, capture_id: str, kind: ExportFormat, *, content: bytes = b"PK") -> None:
    made = exports.prepare(capture_id) / MADE
    made.mkdir()
    (made / "desk.zip").write_bytes(content)
    record = ExportRecord(
        capture_id=capture_id, name="desk", kind=kind, key="0" * 64, points=2, file="desk.zip"
    )
    write_record(made, record)


def test_what_is_being_made_is_not_listed_and_what_is_finished_takes_its_place(tmp_path: Path) -> None:
    exports = ExportCollection(tmp_path / ".exports")
    make(exports, "cap-1", "colmap")
    assert exports.every() == []
    with pytest.raises(NotFound, match="no export to colmap"):
        exports.require("cap-1", "colmap")
    exports.finish("cap-1", "colmap")
    make(exports, "cap-1", "colmap", content=b"PK, newer")
    exports.finish("cap-1", "colmap")
    exports.clear("cap-1")
    (found,) = exports.every()
    assert found.path.read_bytes() == b"PK, newer"
    assert found.size_bytes == len(b"PK, newer")
    assert [path.name for path in exports.making("cap-1").parent.iterdir()] == ["colmap"]


def test_exports_of_any_id_stay_in_their_folder_and_are_removed_by_it(tmp_path: Path) -> None:
    exports = ExportCollection(tmp_path / "captures" / ".exports")
    for capture_id in ("cap-1", STRANGE_ID):
        make(exports, capture_id, "colmap")
        exports.finish(capture_id, "colmap")
    assert [path.name for path in (tmp_path / "captures").iterdir()] == [".exports"]
    exports.remove_by_id(f"{STRANGE_ID}:colmap")
    assert [found.record.capture_id for found in exports.every()] == ["cap-1"]
    exports.remove_all("cap-1")
    exports.remove_all("cap-1")
    assert exports.every() == []


def test_leftovers_of_a_killed_server_are_removed_and_a_damaged_record_is_passed_over(tmp_path: Path) -> None:
    exports = ExportCollection(tmp_path / ".exports")
    make(exports, "cap-1", "colmap")
    exports.finish("cap-1", "colmap")
    (exports.making("cap-1").parent / "colmap" / "export.json").write_text("{")
    (exports.prepare("cap-2") / "half").write_bytes(b"PK")
    exports.clear_all()
    assert not exports.making("cap-2").exists()
    assert exports.made("cap-1", "colmap") is None
    assert exports.every() == []


def test_the_commands_of_retention_know_exports(tmp_path: Path) -> None:
    exports = ExportCollection(tmp_path / "captures" / ".exports")
    make(exports, "cap-1", "ome-zarr")
    exports.finish("cap-1", "ome-zarr")
    (tmp_path / "retention.toml").write_text("[retention.exports]\nkeep_gb = 0.000000001\n")
    shown = CliRunner().invoke(app, ["retention", "show", "--data", str(tmp_path), "--json"])
    (item,) = json.loads(shown.output)["items"]
    assert (item["kind"], item["name"], item["for_good"]) == ("exports", "desk, ome-zarr", True)
    CliRunner().invoke(app, ["retention", "apply", "--data", str(tmp_path)])
    assert exports.every() == []
