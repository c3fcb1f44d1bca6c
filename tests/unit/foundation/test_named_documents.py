from pathlib import Path

import pytest

from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.named_documents import NamedDocument, NamedDocuments


class Note(NamedDocument):
    text: str


def notes(folder: Path) -> NamedDocuments[Note]:
    return NamedDocuments(folder, Note, form="note", version=1)


def test_documents_are_listed_by_name_and_outlive_a_restart(tmp_path: Path) -> None:
    for name in ("Zebra", "ant", "ant.."):
        notes(tmp_path).put(Note(name=name, text="first"))
    notes(tmp_path).put(Note(name="ant", text="second"))
    assert [(note.name, note.text) for note in notes(tmp_path).every()] == [
        ("ant", "second"),
        ("ant..", "first"),
        ("Zebra", "first"),
    ]
    assert notes(tmp_path).get("ant").text == "second"


def test_name_that_is_not_there_names_those_that_are(tmp_path: Path) -> None:
    notes(tmp_path).put(Note(name="ant", text=""))
    with pytest.raises(NotFound, match="nothing named 'bee'; there is ant"):
        notes(tmp_path).delete("bee")
    notes(tmp_path).delete("ant")
    assert notes(tmp_path).every() == []


def test_damaged_file_is_passed_over(tmp_path: Path) -> None:
    notes(tmp_path).put(Note(name="ant", text=""))
    (tmp_path / "damaged.json").write_text("{", encoding="utf-8")
    assert [note.name for note in notes(tmp_path).every()] == ["ant"]
