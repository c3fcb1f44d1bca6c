"""Measure figures, keep them in server/figures.json, and render the tables of the pages from it."""

import argparse
import shlex
import subprocess
import sys
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path

from changed_tests import PACKAGES, ROOT
from figure_runs import FILE, Run, bench_of, described, load, run_name, stale_lines, store
from figure_sources import code_at, code_now
from figure_tables import rendered


def pages(root: Path = ROOT) -> list[Path]:
    """Return all pages of the documentation."""
    folders = {root / folder for folder in PACKAGES.values()}
    return sorted([*root.glob("*.md"), *(page for folder in folders for page in folder.rglob("*.md"))])


def measured(name: str) -> Run:
    """Run a bench and return what it printed."""
    code = code_now(bench_of(name))  # before: files may change while it runs
    command = [sys.executable, "-m", "foveacam_server", "bench", *shlex.split(name), "--json"]
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"figures: `foveacam bench {name}` failed, as said above; nothing is stored")
    return described(name, done.stdout, code=code, printed=datetime.now(UTC))


def printed_before(name: str, path: Path, *, commit: str | None) -> Run:
    """Return what a bench printed to a file on this machine; `commit`: the code, if it has changed since."""
    if not path.is_file():
        raise SystemExit(f"figures: there is no file {path}; foveacam bench {name} --json > {path}")
    code = code_at(bench_of(name), commit) if commit else code_now(bench_of(name))
    printed_s = path.stat().st_mtime
    newer = [] if commit else [file for file in code.hashes() if (ROOT / file).stat().st_mtime > printed_s]
    if newer:
        raise SystemExit(
            f"figures: {path} is older than {len(newer)} of the files that the bench imports"
            f" ({', '.join(newer[:3])}); name the commit that it measured by --commit, or measure again"
        )
    printed = datetime.fromtimestamp(printed_s, tz=UTC)
    return described(name, path.read_bytes(), code=code, printed=printed)


def render(runs: Mapping[str, Run], *, root: Path = ROOT, check: bool = False) -> list[str]:
    """Render the tables of all pages, or with `check` only compare; return what is wrong, a line each."""
    figures, problems = {name: run.figures for name, run in runs.items()}, []
    for path in pages(root):
        text, page = path.read_text(encoding="utf-8"), path.relative_to(root).as_posix()
        new, found = rendered(text, figures, page=page)
        problems += found
        if new != text and check:
            problems.append(f"{page}: its tables are not those of server/figures.json; run 'make figures'")
        elif new != text:
            path.write_text(new, encoding="utf-8")
            print(f"{page}: rendered")
    return problems


def arguments() -> argparse.Namespace:
    """Return what is asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    actions = parser.add_subparsers(dest="action", required=True)
    actions.add_parser("render", help="render all tables, and list the runs whose code has changed")
    actions.add_parser("check", help="fail where a table is not what the file gives; list the same runs")
    run = actions.add_parser("run", help="run a bench, keep its figures, then render")
    take = actions.add_parser("take", help="the same with what a bench has printed to a file")
    for action in (run, take):
        action.add_argument("run", metavar="RUN", help="what follows `foveacam bench`: 'truth --seed 5'")
    take.add_argument("file", type=Path, metavar="FILE", help="what the bench printed with --json")
    take.add_argument("--commit", help="what it measured, if the code has changed since")
    return parser.parse_args()


def main() -> int:
    """Do what is asked; return 1 where a table cannot be rendered, or is not with `check`."""
    chosen = arguments()
    if chosen.action == "run":
        name = run_name(chosen.run)
        store(name, measured(name), file=FILE)
    elif chosen.action == "take":
        name = run_name(chosen.run)
        store(name, printed_before(name, chosen.file, commit=chosen.commit), file=FILE)
    runs = load(FILE)
    problems = render(runs, check=chosen.action == "check")
    for line in stale_lines(runs):
        print(f"out of date: {line}")
    for line in problems:
        print(line, file=sys.stderr)
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
