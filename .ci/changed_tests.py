"""Run the tests that a change reaches by imports, for work in between; `make test` runs everything.

What differs from a commit counts, files that git does not know yet included. Tests that reach a change only
through the whole application, as most of `tests/system` do, are counted and left out.
"""

import argparse
import ast
import functools
import subprocess
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import grimp

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = {
    "foveacam_hardware": "hardware",
    "foveacam_pipeline": "pipeline",
    "foveacam_web": "web",
    "foveacam_server": "server",
    "foveacam_bench": "server",
    "foveacam_client": "server",
}
"""The folder of each package."""
WHOLE = ("foveacam_server.app", "foveacam_server.assembly", "foveacam_server.cli", "foveacam_bench.catalogue")
"""What imports everything: a test that reaches a change through these alone tests the whole application."""
ROUTERS = "foveacam_server.assembly.routers"
QUICK = tuple(f"tests/unit/{name}" for name in ("accounts", "doors", "foundation", "programs"))
"""Folders whose tests of the whole application are run: they look at every route, and open no rig."""
EVERYTHING = ("pyproject.toml", "Makefile", "requirements/", ".ci/run", "tests/conftest.py")
FOLDERS = {
    "web/": ("tests/system/console", "tests/unit/programs"),
    "tests/features/": ("tests/unit/programs",),
}
"""Folders of tests for files that no import reaches."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Selection:
    """Files of tests, relative to the root."""

    run: list[str] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)
    """They reach the change through the whole application alone."""


def select(changed: Iterable[str]) -> Selection:
    """Return the tests that files reach, given by their paths relative to the root."""
    files = sorted(changed)
    tests = test_files()
    if any(path.startswith(EVERYTHING) for path in files):
        return Selection(run=tests)
    graph, imports = product_graph(), test_imports()
    hit = {module for path in files for module in modules_of(path, graph)}
    straight, through = reached(graph, hit, around=WHOLE), reached(graph, hit)
    whole = {path for path in tests if through & closure(path, imports)}
    near = {path for path in tests if straight & closure(path, imports)}
    near |= {path for path in whole if path.startswith(QUICK)}
    near |= {path for path in tests if path in files or by_content(path, files)}
    return Selection(run=sorted(near), left_out=sorted(whole - near))


def by_content(test: str, changed: Iterable[str]) -> bool:
    """Return whether a test reads a changed file: one that its folder tests, or data that it names."""
    for path in changed:
        if any(path.startswith(start) and test.startswith(folders) for start, folders in FOLDERS.items()):
            return True
        if not path.endswith(".py") and Path(path).name in (ROOT / test).read_text(encoding="utf-8"):
            return True
    return False


@functools.cache
def product_graph() -> grimp.ImportGraph:
    """Return the imports among the packages, those by name included."""
    sys.path[:0] = [str(ROOT / folder) for folder in set(PACKAGES.values())]
    graph = grimp.build_graph(*PACKAGES, cache_dir=str(ROOT / ".import_linter_cache"))
    source = (ROOT / "server" / f"{ROUTERS.replace('.', '/')}.py").read_text(encoding="utf-8")
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            module = f"foveacam_server.resources.{node.value}"
            if module in graph.modules:
                graph.add_import(importer=ROUTERS, imported=module)
    return graph


def reached(graph: grimp.ImportGraph, changed: set[str], *, around: tuple[str, ...] = ()) -> set[str]:
    """Return the modules that import changed ones, and these; `around`: not through those."""
    found, open_ = set(changed), list(changed)
    while open_:
        name = open_.pop()
        for module in graph.find_modules_that_directly_import(name) if name in graph.modules else ():
            if module not in found and not module.startswith(around or ("\0",)):
                found.add(module)
                open_.append(module)
    return found


def modules_of(path: str, graph: grimp.ImportGraph) -> Iterator[str]:
    """Yield the module of a file of a package or of the tests; of a data file those beside it."""
    parts = Path(path).parts
    if parts[0] == "tests" and path.endswith(".py"):
        yield path
    for package, folder in PACKAGES.items():
        if parts[:2] != (folder, package):
            continue
        module = ".".join(parts[1:]).removesuffix(".py").removesuffix(".__init__")
        if path.endswith(".py"):
            yield module
        else:
            parent = ".".join(parts[1:-1])
            yield from {parent} & graph.modules
            yield from graph.find_children(parent) if parent in graph.modules else ()


@functools.cache
def test_files() -> list[str]:
    """Return every file of tests."""
    return sorted(path.relative_to(ROOT).as_posix() for path in (ROOT / "tests").rglob("test_*.py"))


@functools.cache
def test_imports() -> dict[str, set[str]]:
    """Return what each Python file of the tests imports: paths of other files there, and modules."""
    return {
        path.relative_to(ROOT).as_posix(): set(_imports(path))
        for path in (ROOT / "tests").rglob("*.py")
        if "__pycache__" not in path.parts
    }


def _imports(path: Path) -> Iterator[str]:
    place = path.relative_to(ROOT).parts
    for depth in range(1, len(place)):  # the fixtures of its folders
        yield "/".join((*place[:depth], "conftest.py"))
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (_target(alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = ".".join(place[: len(place) - node.level]) if node.level else ""
            module = ".".join(filter(None, (base, node.module)))
            yield _target(module)
            yield from (_target(f"{module}.{alias.name}") for alias in node.names)


def _target(module: str) -> str:
    return f"{module.replace('.', '/')}.py" if module.startswith("tests.") else module


def closure(test: str, imports: dict[str, set[str]]) -> set[str]:
    """Return all that a file of tests imports, itself and what its helpers import included."""
    found, open_ = {test}, [test]
    while open_:
        for name in imports.get(open_.pop(), ()):
            if name not in found:
                found.add(name)
                open_.append(name)
    return found


def changed_files(base: str) -> list[str]:
    """Return the files that differ from a commit, or that git does not know."""
    listed = []
    for command in (["diff", "--name-only", base], ["ls-files", "--others", "--exclude-standard"]):
        result = subprocess.run(["git", *command], cwd=ROOT, capture_output=True, text=True, check=False)
        if result.returncode != 0:
            sys.exit(
                f"git cannot compare with {base}: {result.stderr.strip()}; name a commit or branch: BASE=main"
            )
        listed += result.stdout.splitlines()
    return listed


def main() -> int:
    """Run them; further arguments go to pytest."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--base", default="HEAD", help="the commit to compare with")
    parser.add_argument("--list", action="store_true", help="print the files and run nothing")
    chosen, options = parser.parse_known_args()
    selection = select(changed_files(chosen.base))
    if chosen.list:
        print(*selection.run, sep="\n")
        return 0
    print(f"{len(selection.run)} files of tests reach what differs from {chosen.base}", end="")
    print(f"; {len(selection.left_out)} more through the whole application: make test", flush=True)
    if not selection.run:
        return 0
    return subprocess.run(
        [sys.executable, "-m", "pytest", *options, *selection.run], cwd=ROOT, check=False
    ).returncode


if __name__ == "__main__":
    sys.exit(main())
