"""Real servers for benches and tests: `foveacam serve` in its own process, and an application in a thread."""

import asyncio
import re
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import httpx
import uvicorn
from starlette.types import ASGIApp

from foveacam_hardware.contract import DeviceFault
from foveacam_server.doors.server import WatchedServer, server_config
from foveacam_server.rig.stream_socket import listen

_PATIENCE_S = 60.0
_START_PATIENCE_S = 180.0
"""Includes the compilation of the renderer at the first start."""
_POLL_S = 0.02


class ServerProcess:
    """A server that starts with the context and ends with it."""

    def __init__(self, folder: Path, *, port: int, options: Sequence[str] = ()) -> None:
        self._log = folder / "serve.log"
        self._command = [
            *(sys.executable, "-m", "foveacam_server", "serve"),
            *("--port", str(port), "--data", str(folder / "data")),
            *options,
        ]
        self._process: subprocess.Popen[bytes] | None = None
        self.url = f"http://127.0.0.1:{port}/"

    def __enter__(self) -> Self:
        with self._log.open("w") as output:
            self._process = subprocess.Popen(self._command, stdout=output, stderr=subprocess.STDOUT)  # noqa: S603  # our own program
        end_s = time.monotonic() + _START_PATIENCE_S
        while not re.search(r"is ready: ", self._log.read_text()):
            if time.monotonic() > end_s or self._process.poll() is not None:
                self._end()
                raise DeviceFault(f"the bench's server did not start: {self._log.read_text().strip()}")
            time.sleep(_POLL_S)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._end()

    @property
    def process(self) -> subprocess.Popen[bytes]:
        """The server's own process."""
        if self._process is None:
            raise DeviceFault("the bench's server has not been started")
        return self._process

    def send(
        self, method: str, path: str, body: object = None, headers: dict[str, str] | None = None
    ) -> httpx.Response:
        """Send a request to the server."""
        url = f"{self.url}api/v1{path}"
        return httpx.request(
            method, url, json=body, headers=headers, timeout=_PATIENCE_S, trust_env=False
        ).raise_for_status()

    def fixate(self, x_px: float, y_px: float) -> dict[str, Any]:  # Any: a JSON document
        """Look at a wide pixel and return the fixation."""
        body = {"pixel": {"x_px": x_px, "y_px": y_px}}
        return dict(self.send("POST", "/fixations", body, {"Prefer": "wait=60"}).json())

    def clouds(self) -> list[dict[str, Any]]:  # Any: JSON documents
        """Return the documents of all clouds."""
        return list(self.send("GET", "/clouds").json())

    def _end(self) -> None:
        if self._process is None:
            return
        self._process.terminate()
        try:
            self._process.wait(10.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


def free_port() -> int:
    """Return a port of 127.0.0.1 that nobody listens on now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


_START_TIMEOUT_S = 20.0


class _Server(WatchedServer):
    """A server that sets an event when it has started."""

    def __init__(self, config: uvicorn.Config) -> None:
        super().__init__(config)
        self.begun = threading.Event()

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start listening, and set the event."""
        await super().startup(sockets)
        self.begun.set()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Stop, and abort connections whose peers do not read: else their sockets stay open."""
        await super().shutdown(sockets)
        for connection in list(self.server_state.connections):
            connection.transport.abort()
        await asyncio.sleep(0)  # lets the loop close the aborted transports


@contextmanager
def serving(app: ASGIApp) -> Iterator[int]:
    """Serve `app` on a free port of 127.0.0.1 and yield the port, until the context ends."""
    listener = listen("127.0.0.1", 0)
    server = _Server(server_config(app))

    def run() -> None:
        try:
            asyncio.run(server.serve(sockets=[listener]))
        finally:
            server.begun.set()

    thread = threading.Thread(target=run, name="local server")
    thread.start()
    try:
        if not server.begun.wait(_START_TIMEOUT_S) or not server.started:
            raise DeviceFault("the local server did not start; its message stands above")
        yield int(listener.getsockname()[1])
    finally:
        server.should_exit = True
        thread.join()
        listener.close()
