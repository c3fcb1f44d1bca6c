"""Which tests run a line of the product: line coverage with the test as its context, kept between runs.

Only what changed since is measured again: a file of tests that differs is run again, and for a file of the
product that differs every test that ran any line of it counts.
"""

import ast
import hashlib
import json
import os
import re
import sqlite3
import subprocess
import sys
from collections import Counter
from collections.abc import Iterable
from contextlib import closing
from pathlib import Path

from changed_tests import PACKAGES
from coverage import CoverageData

ISOLATED = ("tests/unit/", "tests/wire/", "tests/paper/")
"""Run first: quick, and the same on every machine."""
QUICK_S = 2.0
"""Tests that take longer come last."""


class CoveringTests:
    """The tests by the lines that they run, kept in a folder."""

    def __init__(self, folder: Path, *, root: Path) -> None:
        self._folder, self._root = folder, root
        self._known_path = folder / "known.json"
        known = json.loads(self._known_path.read_text()) if self._known_path.exists() else {}
        self._tests: dict[str, str] = known.get("tests", {})
        self._product: dict[str, str] = known.get("product", {})
        self._line_counts: Counter[str] | None = None
        self.seconds: dict[str, float] = known.get("seconds", {})
        """How long each test that passed took."""

    def measure(self, files: Iterable[str], *, workers: int) -> None:
        """Run those of some files of tests that are not known as they are now."""
        new = [path for path in files if self._tests.get(path) != self._hash(path)]
        if not new:
            return
        self._line_counts = None
        log = self._folder / "outcomes.jsonl"
        log.unlink(missing_ok=True)
        self._folder.mkdir(parents=True, exist_ok=True)
        subprocess.run(  # noqa: S603 - this Python, the project's tests
            [
                *(sys.executable, "-m", "pytest", "-q", "-p", "outcome_log", "-p", "no:cacheprovider"),
                *("-m", "not browser", "--numprocesses", str(workers), "--dist", "loadfile"),
                *(f"--cov={package}" for package in PACKAGES),
                *("--timeout", "600", "--cov-context=test", "--cov-report=", "--cov-append", *new),
            ],
            cwd=self._root,
            env=environment(self._root) | {"COVERAGE_FILE": str(self._data_path), "OUTCOME_LOG": str(log)},
            stdout=(self._folder / "tests.log").open("w"),  # coverage.* would count as data
            stderr=subprocess.STDOUT,
            check=False,
        )
        self.seconds = {name: s for name, s in self.seconds.items() if file_of(name) not in new}
        for line in log.read_text(encoding="utf-8").splitlines():
            entry = json.loads(line)
            if entry["passed"]:
                self.seconds[entry["test"]] = entry["seconds"]
        self._tests |= {path: self._hash(path) for path in new}
        self._product = {path: self._hash(path) for path in product_files(self._root)} | self._product
        known = {"tests": self._tests, "product": self._product, "seconds": self.seconds}
        self._known_path.write_text(json.dumps(known), encoding="utf-8")

    def covering(self, path: str, lines: Iterable[int]) -> list[str]:
        """Return the tests that run any of some lines of a file, those most likely to notice a change first.

        These are isolated and quick, and run little else.
        """
        data = CoverageData(str(self._data_path))
        data.read()
        found = self._contexts(data, path, set(lines))
        if not found:  # it runs when the module is imported: what uses it counts
            found = self._of_use(data, path, min(lines))
        lines_of = self._lines_of(data)

        def rank(name: str) -> tuple[bool, bool, int, str]:
            return not name.startswith(ISOLATED), self.seconds[name] > QUICK_S, lines_of[name], name

        return sorted(found, key=rank)

    def _lines_of(self, data: CoverageData) -> Counter[str]:
        """Return the number of product lines that each test runs."""
        if self._line_counts is None:
            self._line_counts = Counter()
            with closing(sqlite3.connect(data.data_filename())) as database:
                rows = database.execute(
                    "select context, numbits from line_bits join context on context.id = line_bits.context_id"
                )
                for context, lines in rows:
                    self._line_counts[context.rpartition("|")[0]] += int.from_bytes(lines, "big").bit_count()
        return self._line_counts

    @property
    def _data_path(self) -> Path:
        return self._folder / "coverage"

    def _contexts(self, data: CoverageData, path: str, lines: set[int] | None) -> set[str]:
        names: set[str] = set()
        whole = lines is None or self._product.get(path) != self._hash(path)
        for line, contexts in data.contexts_by_lineno(str(self._root / path)).items():
            if whole or line in (lines or ()):
                names |= {context.rpartition("|")[0] for context in contexts if context}
                # A fixture of several tests runs for the first of them: all tests of the file may use it
                of_fixtures = {file_of(context) for context in contexts if context.endswith("|setup")}
                names |= {name for name in self.seconds if file_of(name) in of_fixtures}
        return names & self.seconds.keys()

    def _of_use(self, data: CoverageData, path: str, line: int) -> set[str]:
        source = (self._root / path).read_text(encoding="utf-8")
        body, names = defined_at(source, line)
        if body:
            return self._contexts(data, path, set(body))
        found: set[str] = set()
        for other in product_files(self._root) if names else ():
            hits = used_at((self._root / other).read_text(encoding="utf-8"), names)
            if hits:
                found |= self._contexts(data, other, hits)
        return found or self._contexts(data, path, None)

    def _hash(self, path: str) -> str:
        return hashlib.sha256((self._root / path).read_bytes()).hexdigest()


def defined_at(source: str, line: int) -> tuple[range, set[str]]:
    """Return the body of the innermost function whose head has a line, or the names defined there."""
    body, names = range(0), set[str]()
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.stmt) or not node.lineno <= line <= (node.end_lineno or 0):
            continue
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            body = range(node.body[0].lineno, (node.end_lineno or 0) + 1)
        elif isinstance(node, (ast.Assign, ast.AnnAssign)):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            names = {each.id for each in targets if isinstance(each, ast.Name)}
    return body, names


def used_at(source: str, names: set[str]) -> set[int]:
    """Return the lines that use some names.

    A default value in the head of a function is used wherever the function runs: its body is added.
    """
    used = re.compile(rf"\b({'|'.join(map(re.escape, sorted(names)))})\b")
    hits = {number for number, words in enumerate(source.splitlines(), 1) if used.search(words)}
    for number in sorted(hits):
        body, _ = defined_at(source, number)
        if number < body.start:
            hits |= set(body)
    return hits


def file_of(test: str) -> str:
    """Return the file of a test by its name."""
    return test.partition("::")[0]


def product_files(root: Path) -> list[str]:
    """Return the Python files of the packages, relative to the root."""
    return [
        path.relative_to(root).as_posix()
        for package, folder in PACKAGES.items()
        for path in sorted((root / folder / package).rglob("*.py"))
    ]


def environment(root: Path) -> dict[str, str]:
    """Return the variables under which Python takes the packages of a tree, and this folder's plug-ins."""
    folders = [root / folder for folder in sorted(set(PACKAGES.values()))]
    path = os.pathsep.join(map(str, [*folders, Path(__file__).parent]))
    return {**os.environ, "PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": ""}
