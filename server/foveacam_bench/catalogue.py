"""Lists the benches by name, runs one, and shows its figures as a table."""

import inspect
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path

from rich.console import Console
from rich.table import Table

from foveacam_bench.figures import Figures
from foveacam_hardware.contract import InvalidInput

BENCHES: Mapping[str, str] = {
    "archive": "archive.figures",
    "auth": "access.figures",
    "batch": "batch.figures",
    "binning": "verge.binning",
    "calibration": "calibration.procedures",
    "capture": "capture.captures",
    "clicks": "verge.field_clicks",
    "console": "stream.console",
    "context": "verge.look_around",
    "depth": "depth.dense",
    "doors": "doors.stop",
    "drivers": "drivers.cameras",
    "faults": "faults.all_kinds",
    "learned": "learned.serving",
    "live": "stream.live",
    "loop": "loop.figures",
    "matching": "depth.matching",
    "measure": "depth.measurements",
    "pace": "pace.figures",
    "render": "render.renderer",
    "replay": "replay.long_recording",
    "serial": "drivers.mirror_link",
    "soak": "soak.figures",
    "stereo": "depth.stereo",
    "stream": "stream.streams",
    "track": "track.following",
    "traces": "stream.traces",
    "verge": "verge.fixations",
}
"""Module of each bench, below foveacam_bench; its `run` returns the figures by name."""


def bench_names() -> list[str]:
    """Return the names of all benches, sorted."""
    return sorted(BENCHES)


def run_bench(
    name: str,
    *,
    quick: bool,
    silent: bool,
    data: Path | None = None,
    pairs: Path | None = None,
    binning: int | None = None,
) -> Figures:
    """Run one bench and return its figures; show a spinner unless `silent`.

    `data`: folder of pictures, if any; `pairs`: folder of held-out pairs, if any; `binning`: of the
    simulated cameras, the bench's own choice by default. Raise InvalidInput for an unknown name, and for an
    option that the bench does not have.
    """
    if name not in BENCHES:
        raise InvalidInput(f"there is no bench called {name}; the benches are {', '.join(bench_names())}")
    run = import_module(f"foveacam_bench.{BENCHES[name]}").run
    accepted = inspect.signature(run).parameters
    if data is not None and "data" not in accepted:
        raise InvalidInput(f"bench {name} reads no pictures; leave --data out")
    if pairs is not None and "pairs" not in accepted:
        raise InvalidInput(f"bench {name} reads no pairs with truth; leave --pairs out")
    if binning is not None and "binning" not in accepted:
        raise InvalidInput(f"bench {name} chooses the binning itself; leave --binning out")
    options: dict[str, object] = {"quick": quick, "data": data, "pairs": pairs}
    if binning is not None:
        options["binning"] = binning
    with _spinner(name, silent=silent) as report:
        options["report"] = report
        return dict(run(**{option: value for option, value in options.items() if option in accepted}))


@contextmanager
def _spinner(name: str, *, silent: bool) -> Iterator[Callable[[str], None]]:
    """Show that a bench is measuring, and what it reports of its progress; nothing when `silent`."""
    if silent:
        yield lambda progress: None
        return
    with Console(stderr=True).status(f"measuring: {name} ...") as status:
        yield lambda progress: status.update(f"measuring: {name}: {progress} ...")


def bench_table(name: str, figures: Mapping[str, object]) -> Table:
    """Return the figures as a table."""
    table = Table(title=f"foveacam bench {name}")
    table.add_column("figure")
    table.add_column("value", justify="right")
    for key, value in figures.items():
        table.add_row(key, _shown(value))
    return table


def _shown(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
