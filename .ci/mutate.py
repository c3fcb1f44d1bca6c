"""Make small wrong changes of the product, one at a time, and report those that no test notices.

Each is made in a copy of the tree, where the tests that run its lines are run, the quickest first, until one
fails. A test outside of the isolated folders counts only if it passes without the change, behind the same
tests.
"""

import argparse
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from importlib.util import cache_from_source
from pathlib import Path
from queue import SimpleQueue

from changed_tests import select
from covering_tests import ISOLATED, CoveringTests, environment
from mutation_list import FOLDER, ROOT, Mutation, load

BUDGET_S = 120.0
"""The covering tests of one change, as long as they take without it; the rest is left out and counted."""
START_S = 60.0
"""What pytest may take to start on a busy machine."""
FAILED, BROKEN = 1, 2
"""What pytest returns where a test fails, and where the tests cannot even be imported."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What became of one change.

    `caught_by`: the test that failed, empty where none did. `tests`, `left_out`: how many were run at most,
    and how many more cover it.
    """

    fault: str
    path: str
    line: int
    caught_by: str
    tests: int
    left_out: int
    seconds: float


class Trial:
    """A copy of the tree in which changes are tried, one at a time."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def renew(self, root: Path) -> None:
        """Make it what the tree is now: all files that git knows or would add, and compiled kernels."""
        listed = subprocess.run(
            ["git", "ls-files", "--cached", "--others", "--exclude-standard"],
            cwd=root,
            capture_output=True,
            text=True,
            check=True,
        ).stdout.splitlines()
        wanted = {path for path in listed if (root / path).is_file()}
        kernels = {path.relative_to(root).as_posix() for path in self._kernels(root)}
        for path in wanted | kernels:
            self._take(root / path, self.folder / path)
        for path in self.folder.rglob("*"):
            name = path.relative_to(self.folder).as_posix()
            if path.is_file() and name not in wanted and path.suffix in (".py", ".toml"):
                path.unlink()

    @staticmethod
    def _kernels(root: Path) -> Iterator[Path]:
        for package in ("hardware", "pipeline", "server"):
            yield from (root / package).rglob("*.nb[ci]")

    @staticmethod
    def _take(path: Path, copy: Path) -> None:
        now, before = path.stat(), copy.stat() if copy.exists() else None
        if before is None or (now.st_size, now.st_mtime_ns) != (before.st_size, before.st_mtime_ns):
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(path, copy)  # with its time, by which compiled kernels know their source

    @contextmanager
    def changed(self, mutation: Mutation) -> Iterator[None]:
        """Make a change for as long as it is tried."""
        path = self.folder / mutation.path
        stat, source = path.stat(), path.read_text(encoding="utf-8")
        path.write_text(mutation.applied(source), encoding="utf-8")
        try:
            yield
        finally:
            path.write_text(source, encoding="utf-8")
            # Python compares whole seconds and the size alone
            Path(cache_from_source(str(path))).unlink(missing_ok=True)
            os.utime(path, ns=(stat.st_atime_ns, stat.st_mtime_ns))

    def first_failure(self, tests: list[str], *, limit_s: float) -> str:
        """Run tests until one fails and return its name, empty if all pass."""
        process = subprocess.Popen(  # noqa: S603 - this Python, the project's tests
            [sys.executable, "-m", "pytest", "-q", "-x", "--tb=no", "-p", "no:cacheprovider", *tests],
            cwd=self.folder,
            env=environment(self.folder),
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )
        try:
            said, _ = process.communicate(timeout=limit_s)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
            return f"no end within {limit_s:.0f} s"
        if process.returncode not in (0, FAILED, BROKEN):
            raise RuntimeError(f"pytest ended with {process.returncode}: {said[-2000:]}")
        if process.returncode == 0:
            return ""
        failed = re.search(r"^(?:FAILED|ERROR) (.+?)(?: - .*)?$", said, re.MULTILINE)
        return failed[1] if failed else said[-300:]


def attempt(mutation: Mutation, *, covering: CoveringTests, trial: Trial) -> Outcome:
    """Make one change and run the tests that cover it."""
    start_s = time.monotonic()
    lines = mutation.lines((trial.folder / mutation.path).read_text(encoding="utf-8"))
    tests = covering.covering(mutation.path, lines)
    chosen, sum_s = list[str](), 0.0
    for name in tests:
        sum_s += covering.seconds[name]
        if sum_s > BUDGET_S and chosen:
            break
        chosen.append(name)
    isolated = [name for name in chosen if name.startswith(ISOLATED)]
    # Apart, as pytest runs tests that share a server first
    caught_by = ""
    for some in (isolated, chosen[len(isolated) :]):
        caught_by = caught_by or noticed(mutation, some, trial=trial, limit_s=START_S + 5.0 * sum_s)
    return Outcome(
        fault=mutation.fault,
        path=mutation.path,
        line=lines[0],
        caught_by=caught_by,
        tests=len(chosen),
        left_out=len(tests) - len(chosen),
        seconds=round(time.monotonic() - start_s, 1),
    )


def noticed(mutation: Mutation, tests: list[str], *, trial: Trial, limit_s: float) -> str:
    """Return the first of some tests that fails by a change, empty if none does."""
    left = list(tests)
    while left:
        with trial.changed(mutation):
            failed = trial.first_failure(left, limit_s=limit_s)
        if failed not in left or failed.startswith(ISOLATED):
            return failed
        if trial.first_failure(left, limit_s=limit_s) != failed:
            return failed
        left.remove(failed)  # it fails here by itself
    return ""


def attempt_all(
    mutations: list[Mutation], *, covering: CoveringTests, trials: list[Trial]
) -> Iterator[Outcome]:
    """Make the changes, as many at a time as there are copies, and yield each outcome once it is known."""
    free: SimpleQueue[Trial] = SimpleQueue()
    for trial in trials:
        free.put(trial)

    def run(mutation: Mutation) -> Outcome:
        trial = free.get()
        try:
            return attempt(mutation, covering=covering, trial=trial)
        finally:
            free.put(trial)

    with ThreadPoolExecutor(len(trials)) as pool:
        waiting = [pool.submit(run, mutation) for mutation in mutations]
        for done in as_completed(waiting):
            yield done.result()


def commit_now() -> str:
    """Return the short name of the commit that the tree is at."""
    return subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=False
    ).stdout.strip()


def report(path: Path, outcomes: list[Outcome], *, commit: str) -> dict[str, object]:
    """Write the outcomes and their sums. `commit`: of which the copies are."""
    survivors = [each for each in outcomes if not each.caught_by]
    figures = {
        "commit": commit,
        "mutants": len(outcomes),
        "mutants_caught": round(1.0 - len(survivors) / len(outcomes), 4) if outcomes else None,
        "survivors": [f"{each.path}:{each.line}: {each.fault}" for each in survivors],
    }
    path.write_text(json.dumps(figures | {"outcomes": [asdict(each) for each in outcomes]}, indent=1))
    return figures


def arguments() -> argparse.Namespace:
    """Return what the command line says."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "lists", nargs="*", type=Path, help="files of changes; all in tests/mutations if none"
    )
    parser.add_argument(
        "--only", default="", metavar="WORDS", help="those whose fault or path has these words"
    )
    parser.add_argument("--survivors", action="store_true", help="those that no test noticed in the last run")
    parser.add_argument("--folder", type=Path, default=ROOT / ".mutations", help="for copies and the report")
    parser.add_argument(
        "--within", nargs="+", default=["tests"], metavar="FOLDER", help="take tests of these folders alone"
    )
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    return parser.parse_args()


def last_caught(path: Path, mutations: list[Mutation]) -> list[Outcome]:
    """Return the outcomes of the last run for changes that a test noticed and that are still listed."""
    last = [Outcome(**entry) for entry in json.loads(path.read_text(encoding="utf-8"))["outcomes"]]
    faults = {each.fault for each in mutations}
    return [each for each in last if each.caught_by and each.fault in faults]


def main() -> int:
    """Try the changes of some lists; 1 if any is not noticed."""
    options = arguments()
    folder, path = options.folder.absolute(), options.folder / "report.json"
    try:
        mutations = load(options.lists or sorted(FOLDER.glob("*.toml")))
    except ValueError as error:
        sys.exit(str(error))
    outcomes = last_caught(path, mutations) if options.survivors else []
    kept = {each.fault for each in outcomes}
    left = [each for each in mutations if each.fault not in kept and options.only in each.fault + each.path]
    trials, commit = [Trial(folder / f"copy-{k}") for k in range(options.workers)], commit_now()
    for trial in trials:
        trial.renew(ROOT)
    covering = CoveringTests(folder, root=trials[0].folder)
    reaching = {*select({each.path for each in left}).run, *(path for each in left for path in each.also)}
    near = [path for path in sorted(reaching) if path.startswith(tuple(options.within))]
    print(f"{len(left)} changes, which {len(near)} files of tests may notice", file=sys.stderr, flush=True)
    covering.measure(near, workers=options.workers)
    start_s = time.monotonic()
    for done, outcome in enumerate(attempt_all(left, covering=covering, trials=trials), 1):
        outcomes.append(outcome)
        report(path, outcomes, commit=commit)
        left_s = (time.monotonic() - start_s) / done * (len(left) - done)
        words = f"{outcome.fault}: {outcome.caught_by or 'NOT NOTICED'}"
        print(f"{done} of {len(left)}, {left_s / 60:.0f} min left. {words}", file=sys.stderr, flush=True)
    print(json.dumps(report(path, outcomes, commit=commit), indent=1))
    return 0 if all(each.caught_by for each in outcomes) else 1


if __name__ == "__main__":
    sys.exit(main())
