"""The code that a bench measures, by the hashes of its files.

That is all of this project that the bench imports, programs that it starts by name included, and the data
files beside them.
"""

import hashlib
import re
import subprocess
from dataclasses import dataclass
from pathlib import Path

from changed_tests import PACKAGES, ROOT, changed_files, product_graph

from foveacam_bench.catalogue import BENCHES

NAMED = re.compile(r'"(foveacam_\w+(?:\.\w+)*)"')
"""A module as text: a program that is started by `python -m`."""
DATA = {".json", ".onnx", ".toml", ".yaml"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Code:
    """The code that was measured.

    `uncommitted`: files that differed from the commit. `sources`: by folder and name of a file, the first
    eight digits of git's hash of its content.
    """

    commit: str
    uncommitted: list[str]
    sources: dict[str, dict[str, str]]

    def hashes(self) -> dict[str, str]:
        """Return the hashes by path."""
        return {
            f"{at}/{file}": digits for at, files in self.sources.items() for file, digits in files.items()
        }


def code_now(bench: str) -> Code:
    """Return the code that a bench measures now."""
    hashes = hashes_now(bench)
    return _code("HEAD", hashes, uncommitted=sorted(hashes.keys() & set(changed_files("HEAD"))))


def code_at(bench: str, commit: str) -> Code:
    """Return the code of a commit, as far as the bench imports it now."""
    listed = (line.split(maxsplit=3)[2:] for line in _git("ls-tree", "-r", commit).splitlines())
    hashes = {path: digits[:8] for digits, path in listed}
    return _code(
        commit, {path: hashes[path] for path in source_paths(bench) if path in hashes}, uncommitted=[]
    )


def changed_sources(bench: str, code: Code, *, root: Path = ROOT) -> list[str]:
    """Return the files that differ from those measured, new ones and those that are gone included."""
    then, now = code.hashes(), hashes_now(bench, root=root)
    return sorted(path for path in then.keys() | now.keys() if then.get(path) != now.get(path))


def hashes_now(bench: str, *, root: Path = ROOT) -> dict[str, str]:
    """Return the hashes of all files that a bench measures, by path; none of a bench that is gone."""
    paths = source_paths(bench) if bench in BENCHES else []
    return {path: _hash((root / path).read_bytes()) for path in paths if (root / path).is_file()}


def source_paths(bench: str) -> list[str]:
    """Return the files that a bench measures, relative to the root."""
    paths = {module_path(module) for module in imported_modules(f"foveacam_bench.{BENCHES[bench].module}")}
    for folder in {path.parent for path in paths}:
        beside = [path for path in folder.iterdir() if path.is_dir() and not (path / "__init__.py").exists()]
        paths |= {path for place in (folder, *beside) for path in place.iterdir() if path.suffix in DATA}
    return sorted(path.relative_to(ROOT).as_posix() for path in paths)


def imported_modules(module: str) -> set[str]:
    """Return the modules of this project that one imports or starts, however far, and itself."""
    graph = product_graph()
    found, open_ = {module}, [module]
    while open_:
        one = open_.pop()
        named = NAMED.findall(module_path(one).read_text(encoding="utf-8"))
        started = {*named, *(f"{name}.__main__" for name in named)} & graph.modules
        new = (graph.find_modules_directly_imported_by(one) | started) - found
        found |= new
        open_ += new
    return found


def module_path(module: str) -> Path:
    """Return a module's file."""
    path = ROOT / PACKAGES[module.partition(".")[0]] / module.replace(".", "/")
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


def _code(commit: str, hashes: dict[str, str], *, uncommitted: list[str]) -> Code:
    sources: dict[str, dict[str, str]] = {}
    for path, digits in hashes.items():
        folder, _, file = path.rpartition("/")
        sources.setdefault(folder, {})[file] = digits
    name = _git("rev-parse", "--short=8", commit).strip()
    return Code(commit=name, uncommitted=uncommitted, sources=sources)


def _hash(content: bytes) -> str:
    return hashlib.sha1(b"blob %d\0" % len(content) + content, usedforsecurity=False).hexdigest()[:8]


def _git(*words: str) -> str:
    done = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"figures: git knows no '{words[-1]}'; name a commit that `git log` lists")
    return done.stdout
