"""Browser tests wait for the state of a page: none reads it once and goes on with what it has found."""

import ast
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
AWAITED = "tests/support/pages/awaited.py"
READS = {
    "all",
    "all_inner_texts",
    "all_text_contents",
    "bounding_box",
    "count",
    "evaluate",
    "evaluate_all",
    "evaluate_handle",
    "get_attribute",
    "inner_html",
    "inner_text",
    "input_value",
    "is_checked",
    "is_disabled",
    "is_editable",
    "is_enabled",
    "is_hidden",
    "is_visible",
    "text_content",
}
"""Methods of Playwright's pages and locators that answer at once."""
WITHOUT_ARGUMENTS = {"all", "count"}
"""Of these, lists have namesakes, which take an argument."""
PAGES = {"page", "window", "tab"}
"""Names of pages: their `url` is a state as well."""
WAITING = {"expect_value", "settled", "wait_for"}
"""What reads again and again: a reading may stand in a lambda, or in a function, that it is given."""
ALLOWED = {
    "conftest.py::pytest_runtest_makereport": "which pages there are when a test has failed",
    "console_page.py::Console.frames": "counts that only grow: reading late waits for one frame more",
    "console_page.py::Tabs._idle_tab": "which server an idle tab is at; no test runs in it",
    "console_page.py::Tabs.release_tab": "which server a test was at; it is over",
    "test_console_failures.py::seconds_of_a_plain_answer": "measures how long a request takes",
    "test_listed_origin.py::first_message": "the answer to a connection that the page makes",
    "test_listed_origin.py::order": "the answer to a request that the page sends",
    "test_console_views.py::direction_of": "computes with the page's own module; nothing is shown",
}
"""Functions that read once, by file, each with its reason."""


class Readings:
    """The readings in a file whose values are used although nothing waits, by function and line."""

    def __init__(self, tree: ast.Module) -> None:
        nodes = list(ast.walk(tree))
        self._discarded = {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
        waited_for = {
            each.id for node in nodes if _waits(node) for each in ast.walk(node) if isinstance(each, ast.Name)
        }
        given = [node for node in nodes if isinstance(node, ast.FunctionDef) and node.name in waited_for]
        self._readers: set[str] = set()
        """Functions that a waiting one calls again and again; called otherwise, each is a reading itself."""
        for _ in given:
            self._readers |= {node.name for node in given if any(self._within(node.body))}
        self.found = [
            (".".join(path), node.lineno)
            for path, node in self._within(tree.body)
            if self._readers.isdisjoint(path)
        ]

    def _within(
        self, nodes: Iterable[ast.AST], path: tuple[str, ...] = ()
    ) -> Iterator[tuple[tuple[str, ...], ast.expr]]:
        """Yield each reading that is not repeated, and the names of the functions around it."""
        for node in nodes:
            if isinstance(node, ast.expr) and self._is_reading(node):
                yield path, node
            inner = (*path, node.name) if isinstance(node, ast.ClassDef | ast.FunctionDef) else path
            again = ast.Lambda if _waits(node) else ()
            yield from self._within(
                (each for each in ast.iter_child_nodes(node) if not isinstance(each, again)), inner
            )

    def _is_reading(self, node: ast.expr) -> bool:
        if isinstance(node, ast.Attribute) and node.attr == "url":
            return _name_of(node.value) in PAGES
        if not isinstance(node, ast.Call) or id(node) in self._discarded:
            return False
        name = _name_of(node.func)
        if isinstance(node.func, ast.Name):
            return name in self._readers
        return name in READS and (name not in WITHOUT_ARGUMENTS or not (node.args or node.keywords))


def _waits(node: ast.AST) -> bool:
    return isinstance(node, ast.Call) and _name_of(node.func) in WAITING


def _name_of(node: ast.expr) -> str:
    return node.id if isinstance(node, ast.Name) else node.attr if isinstance(node, ast.Attribute) else ""


def drives_a_browser(path: Path) -> bool:
    return "playwright" in path.read_text(encoding="utf-8") and path != Path(__file__)


def browser_files() -> list[Path]:
    """Return the files of the tests that drive a browser."""
    return [path for path in sorted((ROOT / "tests").rglob("*.py")) if drives_a_browser(path)]


def readings_in(text: str) -> list[tuple[str, int]]:
    return Readings(ast.parse(text)).found


def test_no_browser_test_reads_the_state_of_a_page_once() -> None:
    used: set[str] = set()
    faults: list[str] = []
    files = browser_files()
    for path in files:
        if path == ROOT / AWAITED:
            continue
        for function, line in readings_in(path.read_text(encoding="utf-8")):
            name = f"{path.name}::{function}"
            used.add(name)
            if name not in ALLOWED:
                faults.append(f"{path.relative_to(ROOT)}:{line}: read once in {function}")
    assert len(files) > 30
    assert faults == [], f"use Playwright's expect, or what {AWAITED} has"
    assert used == set(ALLOWED), "an exception that nothing needs any more"


@pytest.mark.parametrize(
    "read_once",
    [
        "def test(page):\n    assert page.locator('li').count() == 2",
        "def test(page):\n    shown = page.locator('p').inner_text()\n    assert shown == '1 m'",
        "def test(page):\n    if page.locator('p').is_visible():\n        page.click('p')",
        "def test(page):\n    assert page.evaluate('innerWidth') == 360",
        "def test(page):\n    assert page.url.endswith('#left')",
        "def test(page):\n    expect(page.locator('li')).to_have_count(page.locator('p').count())",
        "def test(page):\n    expect_value(page, lambda: server.number, page.locator('p').count())",
        "def sizes(page):\n    return page.evaluate('sizes')\n"
        "def test(page):\n    expect_value(page, lambda: sizes(page), [])\n    assert sizes(page) == []",
    ],
)
def test_a_state_that_is_read_once_is_found(read_once: str) -> None:
    assert len(readings_in(read_once)) == 1


@pytest.mark.parametrize(
    "sound",
    [
        "def test(page):\n    expect(page.locator('li')).to_have_count(2)",
        "def test(page):\n    page.evaluate('location.hash = \"#/rig\"')",
        "def test(page):\n    expect_value(page, lambda: page.evaluate('innerWidth'), 360)",
        "def test(page):\n    shown = settled(page, page.locator('p').inner_text)\n    assert shown == '1 m'",
        "def test(page):\n    def rests():\n        return page.evaluate('x')\n    wait_for(page, rests)",
        "def test(page):\n    assert ['a', 'b'].count('a') == 1\n    assert answer.url == '/'",
    ],
)
def test_what_waits_is_not_found(sound: str) -> None:
    assert readings_in(sound) == []
