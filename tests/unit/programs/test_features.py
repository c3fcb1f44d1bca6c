"""The rows of the comparison with the authors' application name tests that there are, or say why none."""

import re
import tomllib
from functools import cache
from pathlib import Path

import pytest
from pydantic import BaseModel, ConfigDict

ROOT = Path(__file__).parents[3]
TABLE = ROOT / "tests" / "features" / "rows.toml"
GROUPS = {"A": 11, "B": 8, "C": 6, "D": 6, "E": 8, "F": 9, "G": 5, "I": 7, "J": 9, "K": 3}
ALL_IDS = {f"{group}{number}" for group, last in GROUPS.items() for number in range(1, last + 1)}
ALL_IDS |= {"F4b", "H", "L"}
LEAST_LETTERS = 20
"""A reason is a sentence."""


class Row(BaseModel):
    """One feature of the authors' application, what is there for it here, and the tests that show it."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    id: str
    feature: str
    ours: str
    tests: list[str]
    lacks: str = ""


class Table(BaseModel):
    """The list of all ids, and their rows."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    ids: list[str]
    row: list[Row]


@cache
def table() -> Table:
    return Table.model_validate(tomllib.loads(TABLE.read_text(encoding="utf-8")))


def faults_of(row: Row) -> list[str]:
    """Return what is wrong with a row."""
    faults = [f"{row.id}: {fault}" for name in row.tests if (fault := absence_of(name)) is not None]
    if not row.tests and len(row.lacks) < LEAST_LETTERS:
        faults.append(f"{row.id}: neither tests nor a reason")
    if row.tests and not row.ours:
        faults.append(f"{row.id}: tests of nothing that we have")
    return faults


def absence_of(name: str) -> str | None:
    """Return which file or function of a test's name there is not; None when both are there."""
    file, _, function = name.partition("::")
    path = ROOT / file
    if not (file.startswith(("tests/", "web/tests/")) and path.is_file()):
        return f"there is no file {file}"
    if function and not re.search(rf"^(async )?def {re.escape(function)}\(", text_of(path), re.MULTILINE):
        return f"there is no test {function} in {file}"
    return None


@cache
def text_of(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def test_every_row_is_there_once() -> None:
    assert len(table().ids) == len(set(table().ids))
    assert set(table().ids) == ALL_IDS
    assert [row.id for row in table().row] == table().ids


@pytest.mark.parametrize("row_id", sorted(ALL_IDS))
def test_a_row_names_tests_that_there_are_or_says_why_there_are_none(row_id: str) -> None:
    (row,) = [row for row in table().row if row.id == row_id]
    assert row.feature.endswith(".")
    assert faults_of(row) == []


@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        ({"tests": [], "lacks": ""}, "neither tests nor a reason"),
        ({"tests": ["tests/unit/test_nothing.py"]}, "there is no file tests/unit/test_nothing.py"),
        ({"tests": ["tests/unit/programs/test_features.py::test_nothing"]}, "there is no test test_nothing"),
        ({"tests": ["/etc/hosts"]}, "there is no file /etc/hosts"),
        ({"ours": ""}, "tests of nothing"),
    ],
)
def test_a_row_that_claims_what_is_not_there_is_found(changes: dict[str, object], fault: str) -> None:
    sound = Row(id="A1", feature="x.", ours="y.", tests=["tests/unit/programs/test_features.py"])
    assert faults_of(sound) == []
    (found,) = faults_of(sound.model_copy(update=changes))
    assert fault in found
