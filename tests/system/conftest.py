"""Servers on the simulated rig that tests share."""

import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from tests.support.servers.running_server import Program, Running, gated, read_until, running, slow_views


@pytest.fixture(autouse=True)
def figures_in_turn(monkeypatch: pytest.MonkeyPatch) -> None:
    """No thread of requests draws a figure: several at once would slow down all others."""
    save = Figure.savefig

    def spy(figure: Figure, *arguments: object, **named: object) -> None:
        assert "AnyIO" not in threading.current_thread().name, "a route draws beside `ComputeQueue.run`"
        save(figure, *arguments, **named)  # type: ignore[arg-type]  # as they came

    monkeypatch.setattr(Figure, "savefig", spy)


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    """A server that the tests of one file share."""
    with running(tmp_path_factory.mktemp("data")) as found:
        yield found


@pytest.fixture
def program(tmp_path: Path) -> Iterator[Callable[..., Program]]:
    """Start `foveacam serve` with more arguments; it is ended afterwards."""
    started: list[subprocess.Popen[str]] = []

    def start(*arguments: str, data: Path | None = None, module: str = "foveacam_server") -> Program:
        folder = data or tmp_path / "data"
        command = [
            sys.executable,
            "-m",
            module,
            "serve",
            "--port",
            "0",
            "--data",
            str(folder),
            *arguments,
        ]
        process = subprocess.Popen(
            command,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env={**slow_views(), "COLUMNS": "200"},
        )
        started.append(process)
        return Program(process, read_until(process, r"is ready: (\S+)"))

    yield start
    for process in started:
        process.terminate()
        process.wait(20)


@pytest.fixture
def gate() -> Iterator[threading.Event]:
    """Captures wait behind every look while it is closed."""
    with gated() as found:
        yield found
