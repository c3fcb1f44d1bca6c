"""A whole server for the browser: in the process of the tests, or `foveacam serve` in one of its own."""

import re
import ssl
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

import httpx

from tests.system import server_state
from tests.system.conftest import API, Running, slow_views

PATIENCE_S = 30.0
START_PATIENCE_S = 180.0  # where the renderer has not been compiled yet, a server does that first
_POLL_MS = 30
_TLS = ssl.create_default_context()  # spoken by nobody here, but else made anew by every request: 35 ms


@dataclass(frozen=True)
class Server:
    """A whole server, as its clients see it, and the folder of its data."""

    url: str
    data: Path

    def get(self, path: str) -> dict[str, Any]:  # Any: a JSON document
        return dict(self.send("GET", path).json())

    def send(
        self, method: str, path: str, body: object = None, *, headers: dict[str, str] | None = None
    ) -> httpx.Response:
        url = f"{self.url.rstrip('/')}{API}{path}"
        return httpx.request(
            method, url, json=body, headers=headers, timeout=PATIENCE_S, trust_env=False, verify=_TLS
        )

    def be_idle(self) -> None:
        """Release the stop, cancel what waits or runs, and wait until nothing does."""
        with httpx.Client(base_url=self.url, timeout=PATIENCE_S, trust_env=False, verify=_TLS) as http:
            http.delete(f"{API}/stop")
            server_state.end_jobs(http)

    def wait_for_cloud(self) -> None:
        """Wait until the shape of a fixation is there: its views can be measured then."""
        end_s = time.monotonic() + PATIENCE_S
        while not self.send("GET", "/clouds").json():
            assert time.monotonic() < end_s, "no cloud came"
            time.sleep(0.2)


@dataclass(frozen=True)
class ServerProgram:
    """`foveacam serve` in a process of its own."""

    process: subprocess.Popen[bytes]
    url: str

    def end(self) -> None:
        self.process.terminate()
        self.process.wait(20)


StartServer = Callable[..., ServerProgram]


def server_of(running: Running) -> Server:
    """Return the server in this process as its clients see it."""
    return Server(f"http://127.0.0.1:{running.port}/", running.services.settings.data)


def greeting(process: subprocess.Popen[bytes], log: Path) -> str:
    """Return the address that the server prints once it is ready."""
    end_s = time.monotonic() + START_PATIENCE_S
    while time.monotonic() < end_s and process.poll() is None:
        if found := re.search(r"is ready: (\S+)", log.read_text()):
            return found[1]
        time.sleep(_POLL_MS / 1000)
    process.kill()
    process.wait()
    raise AssertionError(f"the server did not start: {log.read_text()}")


@contextmanager
def servers(data: Path) -> Iterator[StartServer]:
    """Start servers that end with the context."""
    logs = count()
    with ExitStack() as stack:

        def start(*arguments: str) -> ServerProgram:
            log = data.with_suffix(f".{next(logs)}.log")
            command = [sys.executable, "-m", "foveacam_server", "serve", "--port", "0", "--data", str(data)]
            with log.open("w") as output:
                process = subprocess.Popen(
                    [*command, *arguments], stdout=output, stderr=subprocess.STDOUT, env=slow_views()
                )
            program = ServerProgram(process, greeting(process, log))
            stack.callback(program.end)
            return program

        yield start
