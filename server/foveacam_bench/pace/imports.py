"""Modules loaded at a server's start, time of a set-up and its first start, and size of both."""

import os
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from foveacam_bench.figures import Figures
from foveacam_bench.pace.start import TimedServer

ROOT = Path(__file__).parents[3]
PROGRAM = (
    "import sys, time; import foveacam_server.cli, foveacam_server.serving; "
    "print(time.process_time(), len(sys.modules))"
)
REPEATS, QUICK_REPEATS = 3, 1
BASE_PROGRAM = """
from importlib.metadata import PackageNotFoundError, distribution
from packaging.requirements import Requirement
left, done, sizes = [("foveacam-duo", "")], set(), {}
while left:
    name, extra = one = left.pop()
    if one in done:
        continue
    done.add(one)
    try:
        found = distribution(name)
    except PackageNotFoundError:
        continue
    sizes[name] = sum(p.stat().st_size for p in map(found.locate_file, found.files or []) if p.is_file())
    for need in map(Requirement, found.requires or []):
        if need.marker is None or need.marker.evaluate({"extra": extra}):
            left += [(need.name.lower().replace("_", "-"), more) for more in ["", *need.extras]]
print(sum(sizes.values()))
"""
"""Prints the size of the project and of what it requires without extras, bytes."""
FILES = ("Makefile", "pyproject.toml", "README.md", "LICENSE", "requirements")
PACKAGES = ("hardware", "pipeline", "web", "server")
SETUP_LIMIT_S = 900.0


@dataclass(frozen=True, slots=True, kw_only=True)
class NewEnvironment:
    """Times and size of a set-up; None where it was not made, or failed."""

    set_up_s: float | None = None
    ready_s: float | None = None
    """From the call of its server to the first answer that it is ready."""
    base_mb: float | None = None
    """Size of what is needed without extras."""

    @property
    def clone_to_ready_s(self) -> float | None:
        """Time of both; None without either."""
        return None if self.set_up_s is None or self.ready_s is None else self.set_up_s + self.ready_s


def import_figures(*, quick: bool = False) -> Figures:
    """Return processor time and modules of a server's start, and, not `quick`, what the set-ups take.

    Packages come from uv's or pip's cache where it has them; a set-up that fails is null. `clone_to_ready_s`:
    the set-up and the first start of what it installed, without bytecode or kernels.
    """
    base = NewEnvironment() if quick else _set_up(".venv/.installed", start=True)
    dev = NewEnvironment() if quick else _set_up("setup")
    return {
        **start_figures(QUICK_REPEATS if quick else REPEATS),
        "setup_base_s": base.set_up_s,
        "setup_dev_s": dev.set_up_s,
        "environment_base_mb": base.base_mb,
        "clone_to_ready_s": base.clone_to_ready_s,
    }


def start_figures(repeats: int = REPEATS) -> Figures:
    """Return the least processor time of some starts, whose bytecode is there, and the number of modules."""
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "PYTHONDONTWRITEBYTECODE": ""}
    times_s, modules = [], 0
    for _ in range(repeats):
        command = [sys.executable, "-c", PROGRAM]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)  # noqa: S603 - itself
        took_s, count = done.stdout.split()
        times_s.append(float(took_s))
        modules = int(count)
    return {"start_import_cpu_s": min(times_s), "start_modules": modules}


def _set_up(target: str, *, start: bool = False) -> NewEnvironment:
    """Set up a new folder by make, and start what it installed if asked to."""
    make = shutil.which("make")
    if make is None:
        return NewEnvironment()
    with tempfile.TemporaryDirectory(prefix="foveacam-setup-") as name:
        folder = Path(name)
        _copy_sources(folder)
        command = [make, f"PYTHON={sys.base_prefix}/bin/python3", target]
        began_s = time.monotonic()
        made = subprocess.run(command, cwd=folder, capture_output=True, timeout=SETUP_LIMIT_S, check=False)  # noqa: S603 - the project's own
        took_s = time.monotonic() - began_s
        if made.returncode != 0:
            return NewEnvironment()
        ready_s = _first_ready_s(folder) if start else None
        return NewEnvironment(set_up_s=took_s, ready_s=ready_s, base_mb=_base_mb(folder / ".venv"))


def _first_ready_s(folder: Path) -> float | None:
    """Return how long a server of a new environment takes to be ready."""
    kernels = folder / "kernels"
    kernels.mkdir()
    with TimedServer(folder, kernels=kernels, python=str(folder / ".venv/bin/python")) as server:
        return server.times().ready_s


def _copy_sources(folder: Path) -> None:
    ignored = shutil.ignore_patterns("__pycache__", "node_modules")
    for name in (*FILES, *PACKAGES):
        source = ROOT / name
        if source.is_dir():
            shutil.copytree(source, folder / name, ignore=ignored)
        else:
            shutil.copy(source, folder / name)


def _base_mb(environment: Path) -> float:
    """Return the size of the packages without extras and of what `venv` put there, 2^20 bytes each MB."""
    done = subprocess.run(  # noqa: S603 - the Python of the new environment
        [environment / "bin/python", "-c", BASE_PROGRAM], capture_output=True, text=True, check=True
    )
    pip = sum(path.stat().st_size for path in environment.rglob("site-packages/pip/**/*") if path.is_file())
    return (int(done.stdout) + pip) / 2**20
