"""`foveacam serve` in its own process, for benches."""

import os
import re
import socket
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

import httpx

from foveacam_client.document import JsonObject
from foveacam_hardware.contract import DeviceFault

SERVE = ("foveacam_server", "serve", "--port", "{port}", "--data", "{data}")
_PATIENCE_S = 60.0
_START_PATIENCE_S = 180.0
"""Includes the compilation of the renderer at the first start."""
_POLL_S = 0.02


class ServerProcess:
    """A server that starts with the context and ends with it."""

    def __init__(
        self,
        folder: Path,
        *,
        port: int,
        options: Sequence[str] = (),
        program: Sequence[str] = SERVE,
        environment: Mapping[str, str] | None = None,
    ) -> None:
        """`program`: module and arguments, with {port} and {data} in place of both.

        `environment`: variables beside those of this process.
        """
        self._environment = {**os.environ, **(environment or {})}
        self._log = folder / "serve.log"
        called = [part.format(port=port, data=folder / "data") for part in program]
        self._command = [sys.executable, "-m", *called, *options]
        self._process: subprocess.Popen[bytes] | None = None
        self.url = f"http://127.0.0.1:{port}/"

    def __enter__(self) -> Self:
        with self._log.open("w") as output:
            self._process = subprocess.Popen(  # noqa: S603  # our own program
                self._command, stdout=output, stderr=subprocess.STDOUT, env=self._environment
            )
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

    @property
    def log(self) -> str:
        """All that the server has written."""
        return self._log.read_text()

    def send(
        self, method: str, path: str, body: object = None, headers: dict[str, str] | None = None
    ) -> httpx.Response:
        """Send a request to the server."""
        url = f"{self.url}api/v1{path}"
        return httpx.request(
            method, url, json=body, headers=headers, timeout=_PATIENCE_S, trust_env=False
        ).raise_for_status()

    def fixate(self, x_px: float, y_px: float) -> JsonObject:
        """Look at a wide pixel and return the fixation."""
        body = {"pixel": {"x_px": x_px, "y_px": y_px}}
        return dict(self.send("POST", "/fixations", body, {"Prefer": "wait=60"}).json())

    def clouds(self) -> list[JsonObject]:
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
