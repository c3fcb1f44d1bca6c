"""Finds and runs the benches: modules under `bench/` whose `run` returns named figures."""

import inspect
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from types import ModuleType

from rich.console import Console
from rich.table import Table

from foveacam_hardware.contract import InvalidInput

BENCHES = Path(__file__).parent / "bench"


def bench_names() -> list[str]:
    """Return the modules under `bench/` that can be run."""
    return sorted(
        path.stem for path in BENCHES.glob("*.py") if "\ndef run(" in path.read_text(encoding="utf-8")
    )


def run_bench(name: str, *, quick: bool, silent: bool, data: Path | None = None) -> dict[str, object]:
    """Run one bench; unless `silent`, a spinner shows that it works. `data`: folder of pictures, if any."""
    names = bench_names()
    if name not in names:
        raise InvalidInput(f"there is no bench called {name}; the benches are {', '.join(names)}")
    module = import_module(f"foveacam_server.bench.{name}")
    if silent:
        return _figures(module, quick=quick, data=data)
    with Console(stderr=True).status(f"measuring: {name} ..."):
        return _figures(module, quick=quick, data=data)


def bench_table(name: str, figures: Mapping[str, object]) -> Table:
    """Return the figures as a table; bars that a bench names (`…`) stand beside them."""
    table = Table(title=f"foveacam bench {name}")
    table.add_column("figure")
    table.add_column("value", justify="right")
    for key, value in figures.items():
        table.add_row(key, _shown(value))
    return table


def _figures(module: ModuleType, *, quick: bool, data: Path | None) -> dict[str, object]:
    takes = inspect.signature(module.run).parameters
    if data is not None and "data" not in takes:
        raise InvalidInput(f"bench {module.__name__.rpartition('.')[2]} reads no pictures; leave --data out")
    options: dict[str, object] = {"quick": quick, "data": data}
    return dict(module.run(**{name: value for name, value in options.items() if name in takes}))


def _shown(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
