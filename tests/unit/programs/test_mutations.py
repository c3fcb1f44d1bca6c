"""The lists of wrong changes that tests must notice, and the program that makes them."""

import importlib
from pathlib import Path
from types import ModuleType

import pytest
from coverage import CoverageData

ROOT = Path(__file__).parents[3]
LISTS = sorted((ROOT / "tests" / "mutations").glob("*.toml"))
SOURCE = '''"""A module."""

FACTOR = 2.0


def doubled(
    value: float, *, factor: float = FACTOR
) -> float:
    """Return more."""
    return value * factor
'''


def program(name: str) -> ModuleType:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / ".ci"))
        return importlib.import_module(name)


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    (tmp_path / "module.py").write_text(SOURCE, encoding="utf-8")
    return tmp_path


def written(folder: Path, **changed: str) -> Path:
    entry = {
        "fault": "Thrice",
        "path": "module.py",
        "find": "FACTOR = 2.0",
        "replace": "FACTOR = 3.0",
    } | changed
    path = folder / "list.toml"
    path.write_text("[[mutation]]\n" + "\n".join(f"{key} = {value!r}" for key, value in entry.items()))
    return path


def test_every_listed_change_can_be_made() -> None:
    listed = program("mutation_list").load(LISTS)
    assert len(listed) >= 200


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"path": "gone.py"}, "gone.py does not exist"),
        ({"find": "factor"}, "2 times"),
        ({"find": "FACTOR = 4.0"}, "0 times"),
        ({"replace": "FACTOR = 2.0"}, "it changes nothing"),
        ({"replace": "FACTOR = ("}, "no Python"),
    ],
)
def test_a_change_that_cannot_be_made_is_named(tree: Path, changed: dict[str, str], words: str) -> None:
    with pytest.raises(ValueError, match=f"'Thrice': .*{words}"):
        program("mutation_list").load([written(tree, **changed)], root=tree)


def test_two_changes_of_one_fault_are_refused(tree: Path) -> None:
    path = written(tree)
    with pytest.raises(ValueError, match="'Thrice' is listed twice"):
        program("mutation_list").load([path, path], root=tree)


def test_a_change_is_there_while_it_is_tried_and_the_file_is_as_before_afterwards(tree: Path) -> None:
    [mutation] = program("mutation_list").load([written(tree)], root=tree)
    file = tree / "module.py"
    before = file.stat().st_mtime_ns
    with program("mutate").Trial(tree).changed(mutation):
        assert "FACTOR = 3.0" in file.read_text()
    assert (file.read_text(), file.stat().st_mtime_ns) == (SOURCE, before)


def test_a_failing_test_is_named_and_a_passing_one_is_not(tree: Path) -> None:
    (tree / "test_module.py").write_text(
        "from module import doubled\n\ndef test_it_doubles():\n    assert doubled(2.0) == 4.0\n"
    )
    [mutation] = program("mutation_list").load([written(tree)], root=tree)
    trial = program("mutate").Trial(tree)
    name = "test_module.py::test_it_doubles"
    assert program("mutate").noticed(mutation, [name], trial=trial, limit_s=60.0) == name
    assert trial.first_failure([name], limit_s=60.0) == ""


def test_lines_that_run_at_the_import_lead_to_what_uses_them() -> None:
    defined_at = program("covering_tests").defined_at
    assert defined_at(SOURCE, 3) == (range(0), {"FACTOR"})
    assert defined_at(SOURCE, 7)[0] == range(9, 11)


def test_a_constant_that_is_a_default_is_used_by_the_body_of_its_function() -> None:
    used_at = program("covering_tests").used_at
    assert used_at(SOURCE, {"FACTOR"}) == {3, 7, 9, 10}
    assert used_at(SOURCE, {"value"}) == {7, 9, 10}
    assert used_at(SOURCE, {"FACT"}) == set()


def test_isolated_quick_tests_that_run_little_else_come_first(tree: Path, tmp_path: Path) -> None:
    lines_s = {
        "tests/system/test_all.py::test_page": (1, 0.1),
        "tests/unit/test_slow.py::test_doubles": (1, 30.0),
        "tests/unit/test_all.py::test_everything": (5, 0.1),
        "tests/unit/test_module.py::test_doubles": (1, 0.2),
    }
    data = CoverageData(str(tmp_path / "coverage"))
    for test, (others, _) in lines_s.items():
        data.set_context(f"{test}|run")
        data.add_lines({str(tree / "module.py"): range(10, 10 + others)})
    data.write()
    covering = program("covering_tests").CoveringTests(tmp_path, root=tree)
    covering.seconds = {test: seconds for test, (_, seconds) in lines_s.items()}
    assert covering.covering("module.py", [10]) == list(reversed(lines_s))
