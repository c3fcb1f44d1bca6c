"""Runs before any test: options of the test run, and what a library reads when it is imported."""

import gc
import os
import re
import sys
from functools import cache
from importlib import import_module
from pathlib import Path

import pytest
from hypothesis import settings
from xdist.remote import Producer
from xdist.scheduler import LoadFileScheduling

from tests.support.cpu_seconds import CpuSeconds

ROOT = Path(__file__).parents[1]
CONTROLLER_PORT = "FOVEACAM_CONTROLLER_PORT"
"""Names the port of a mirror controller that is none of ours."""
CONSOLE, API = "tests/system/console", "tests/system/api"
"""Folders whose files share a server or a browser."""
SHARED_SERVER = re.compile(r"\b(page_server|page_rig|shared_rig)\b")
"""Names by which a file of the console's tests uses the one live server of that folder."""
SHARING = (f"{CONSOLE} on its server", f"{CONSOLE} without", API)
"""Groups of files that one worker runs, since it opens what they share."""
LASTING = ("server", "api_server", "page_server", "own_server", "shared_rig", "shared_server")
"""Fixtures with a simulated rig: the files that need none of them come first, while another worker compiles
the renderer; those come last whose servers run until their folder ends."""

gc.disable()  # until the tests are collected: what is imported stays, and searching it takes half that time


def pytest_addoption(parser: pytest.Parser) -> None:
    """Offer to run the contracts on a real rig, and to count processor time."""
    parser.addoption(
        "--rig", default=None, metavar="FILE", help="run the contracts on the rig of this rig file"
    )
    parser.addoption(
        "--cpu-seconds", default=None, metavar="FILE", help="write the processor time of each file of tests"
    )


def pytest_configure(config: pytest.Config) -> None:
    """Give every process of the tests three emulated Basler cameras, and examples the time they take."""
    os.environ.setdefault("PYLON_CAMEMU", "3")
    for library in ("OPENBLAS", "OMP", "MKL"):  # before it is loaded
        # Every core already has a process; further threads would only wait for one another
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")
    # A moment in which this machine stands still is no failure of an example
    settings.register_profile("busy", deadline=None)
    settings.load_profile("busy")
    if (path := config.getoption("--cpu-seconds")) is not None:
        config.pluginmanager.register(CpuSeconds(Path(path).absolute()))


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out what needs a controller that nobody named, and put the files into a good order."""
    if not os.environ.get(CONTROLLER_PORT):
        absent = [item for item in items if item.get_closest_marker("external_controller")]
        items[:] = [item for item in items if item not in absent]
        config.hook.pytest_deselected(items=absent)
    lasting: dict[Path, int] = {}
    for item in items:
        needs = [LASTING.index(name) + 1 for name in getattr(item, "fixturenames", ()) if name in LASTING]
        lasting[item.path] = max([lasting.get(item.path, 0), *needs])
    items.sort(key=lambda item: (_turn(item), lasting[item.path]))


def pytest_collection_finish() -> None:
    """Collect garbage from now on, outside of what was imported."""
    gc.freeze()
    gc.enable()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Producer) -> LoadFileScheduling | None:
    """Let one worker run all files of a group that shares a server or a browser."""
    return _FolderScheduling(config, log) if config.getvalue("dist") == "loadfile" else None


class _FolderScheduling(LoadFileScheduling):  # type: ignore[misc]  # xdist ships no types
    def _split_scope(self, nodeid: str) -> str:
        file: str = super()._split_scope(nodeid)
        return _sharing(file) or file


@cache
def _sharing(path: str) -> str | None:
    """Return the group of files that share a server or a browser in which a file is."""
    if path.startswith(f"{CONSOLE}/"):
        source = (ROOT / path).read_text(encoding="utf-8")
        return SHARING[0] if SHARED_SERVER.search(source) else SHARING[1]
    return API if path.startswith(f"{API}/") else None


def _turn(item: pytest.Item) -> int:
    """Return how early a test comes: folders that one worker runs, then files that wait for a rig."""
    path = item.path.relative_to(item.config.rootpath).as_posix()
    if shared := _sharing(path):
        return SHARING.index(shared) - len(SHARING)
    return 0 if path.startswith(("tests/system/", "tests/integration/")) else 1


@pytest.fixture
def without_benches(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let every import of foveacam_bench fail, which a wheel lacks."""
    for name in [name for name in sys.modules if name.partition(".")[0] == "foveacam_bench"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "foveacam_bench", None)
    with pytest.raises(ModuleNotFoundError):
        import_module("foveacam_bench.catalogue")
