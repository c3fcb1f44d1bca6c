"""Keep the outputs of benches in server/figures.json, a line for each run, and list those out of date.

A run is named by the command line after `foveacam bench`.
"""

import json
import os
import platform
import re
import shlex
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path

from changed_tests import ROOT
from figure_sources import Code, changed_sources

from foveacam_bench.catalogue import BENCHES, bench_names
from foveacam_bench.pace.reference import reference_ms
from foveacam_pipeline.storage.disk import write_file

FILE = ROOT / "server" / "figures.json"
LONGEST = 2000
"""Characters of JSON: a figure with more, such as a list of every wrong click, is left out."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """The figures of one run of a bench.

    `date`: UTC, when they were printed. `reference_ms`: of the pace bench, as the run printed it or else
    measured on the same machine when the figures were stored. `left_out`: names of figures that are too long.
    """

    date: str
    machine: str
    reference_ms: float
    figures: dict[str, object]
    left_out: list[str]
    code: Code


def load(file: Path) -> dict[str, Run]:
    """Return the stored runs by their names."""
    if not file.is_file():
        return {}
    try:
        stored = json.loads(file.read_text(encoding="utf-8"))
        return {name: Run(**{**run, "code": Code(**run["code"])}) for name, run in stored.items()}
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise SystemExit(f"figures: {file} has no runs in it ({error}); restore it by git") from error


def store(name: str, run: Run, *, file: Path) -> None:
    """Add a run, or replace the one of the same name."""
    runs = {**load(file), name: run}
    lines = (f" {json.dumps(key)}: {json.dumps(asdict(runs[key]))}" for key in sorted(runs))
    write_file(file, ("{\n" + ",\n".join(lines) + "\n}\n").encode())


def run_name(command: str) -> str:
    """Return a command line as runs are named: without `--json`, single spaces."""
    try:
        words = [word for word in shlex.split(command) if word != "--json"]
    except ValueError:  # a quote that is not closed
        words = []
    if not words or words[0] not in BENCHES:
        raise SystemExit(
            f"figures: '{command}' names no bench; begin with one of {', '.join(bench_names())},"
            " such as RUN='truth --seed 5'"
        )
    return " ".join(words)


def bench_of(name: str) -> str:
    """Return the bench of a run."""
    return name.split()[0]


def described(name: str, output: str | bytes, *, code: Code, printed: datetime) -> Run:
    """Return what a bench has printed on this machine as a run."""
    figures = _figures(name, output)
    reference = figures.get("reference_ms")
    long = [key for key, value in figures.items() if len(json.dumps(value)) > LONGEST]
    return Run(
        date=printed.strftime("%Y-%m-%dT%H:%M:%SZ"),
        machine=machine(),
        reference_ms=reference if isinstance(reference, float) else reference_ms(),
        figures={key: value for key, value in figures.items() if key not in long},
        left_out=long,
        code=code,
    )


def _figures(name: str, output: str | bytes) -> dict[str, object]:
    """Return the figures that a run printed; refuse those of another seed."""
    try:
        found = json.loads(output)
    except ValueError:
        found = None
    if not isinstance(found, dict):
        raise SystemExit(f"figures: no JSON object was printed for '{name}'; foveacam bench {name} --json")
    words = name.split()
    seed = words[words.index("--seed") + 1] if "--seed" in words[:-1] else None
    if seed is not None and str(found.get("seed", seed)) != seed:
        raise SystemExit(
            f"figures: the output is of seed {found['seed']}, not of '{name}'; name its own seed"
        )
    return found


def machine() -> str:
    """Return the processor, its cores and the memory."""
    listed = Path("/proc/cpuinfo")
    model = re.search(r"^model name\s*: (.+)$", listed.read_text() if listed.is_file() else "", re.MULTILINE)
    memory_gb = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9
    processor = model[1] if model else platform.processor() or platform.machine()
    return f"{processor}, {os.cpu_count()} cores, {memory_gb:.0f} GB"


def stale_lines(runs: Mapping[str, Run], *, root: Path = ROOT) -> Iterator[str]:
    """Yield a line for each run whose bench, or code that it imports, has changed since it was measured."""
    for name, run in runs.items():
        if changed := changed_sources(bench_of(name), run.code, root=root):
            first = ", ".join(changed[:3]) + (", …" if len(changed) > 3 else "")
            count = f"{len(changed)} {'file' if len(changed) == 1 else 'files'} changed"
            yield f"{name}: {count} since {run.code.commit} ({run.date[:10]}): {first}"
