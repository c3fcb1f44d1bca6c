"""The server under test: its REST, its clock, its disk, and the resources of its process."""

import json
import operator
import re
import socket
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import reduce
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import httpx

from foveacam_bench.servers import ServerProcess, free_port
from foveacam_hardware.contract import DeviceFault

PATIENCE_S = 120.0
POLL_S = 0.1
REST_SAMPLES = 10
"""Samples of the resources at rest: a thread that ends, or a file that is just read, is only in some of
them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Resources:
    """Resources of a process, and the size of its database."""

    t_s: float
    rss_mb: float
    threads: int
    files: Counter[str]
    """Number of open descriptors by target, without the numbers of sockets and pipes."""
    database_mb: float


class SoakedServer:
    """A server on the simulated rig whose clock skips; it starts and ends with the context."""

    def __init__(self, folder: Path) -> None:
        self.data = folder / "data"
        self._orders_path = folder / "orders"
        self._process = ServerProcess(
            folder,
            port=free_port(),
            program=("foveacam_bench.soak.server_program", "{port}", "{data}", str(self._orders_path)),
        )
        self._http = httpx.Client(timeout=PATIENCE_S, trust_env=False)
        self._line = socket.socket(socket.AF_UNIX)

    def __enter__(self) -> Self:
        self._process.__enter__()
        self._line.connect(str(self._orders_path))
        self._lines = self._line.makefile("rw")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._line.close()
        self._http.close()
        self._process.__exit__(kind, error, trace)

    @property
    def url(self) -> str:
        """Its address, with a slash at the end."""
        return self._process.url

    def skip(self, duration_s: float) -> float:
        """Let time pass for the server; return its clock, s."""
        return self._order(skip_s=duration_s)["t_s"]

    def require_rest(self, required: bool) -> None:
        """Start, or stop, counting the time in which mirrors are driven."""
        self._order(must_rest=required)

    @property
    def unparked_s(self) -> float:
        """Time so far in which mirrors were driven while they were required to rest."""
        return self._order()["unparked_s"]

    def _order(self, **order: object) -> dict[str, float]:
        self._lines.write(json.dumps(order) + "\n")
        self._lines.flush()
        return dict(json.loads(self._lines.readline()))

    def send(
        self, method: str, path: str, body: object = None, headers: Mapping[str, str] | None = None
    ) -> httpx.Response:
        """Send a request, and return the answer whatever its status."""
        return self._http.request(method, f"{self.url}api/v1{path}", json=body, headers=headers)

    def get(self, path: str) -> Any:  # noqa: ANN401 - a JSON document
        """Return the document at a path."""
        return self.send("GET", path).raise_for_status().json()

    def wait_until(self, enough: Callable[[], bool], what: str) -> None:
        """Wait until a condition holds; raise `DeviceFault` when it does not within two minutes."""
        end_s = time.monotonic() + PATIENCE_S
        while not enough():
            if time.monotonic() > end_s:
                raise DeviceFault(f"waited {PATIENCE_S:.0f} s for {what}")
            time.sleep(POLL_S)

    def resources(self) -> Resources:
        """Return the resources at rest: threads and files are the least of a second's samples."""
        samples = [self._sample() for _ in range(REST_SAMPLES)]
        return replace(
            samples[-1],
            threads=min(sample.threads for sample in samples),
            files=reduce(operator.and_, (sample.files for sample in samples)),
        )

    def _sample(self) -> Resources:
        time.sleep(POLL_S)
        return process_resources(self._process.process.pid, self.data, t_s=self.skip(0.0))


def process_resources(pid: int, data: Path, *, t_s: float) -> Resources:
    """Return the resources of a server's process, and the size of the database in its data folder."""
    process = Path(f"/proc/{pid}")
    status = dict(line.split(":", 1) for line in (process / "status").read_text("ascii").splitlines())
    database = sum(path.stat().st_size for path in data.glob("foveacam.sqlite*"))
    return Resources(
        t_s=t_s,
        rss_mb=int(status["VmRSS"].split()[0]) / 1024,
        threads=int(status["Threads"]),
        files=Counter(_open_files(process)),
        database_mb=database / 1e6,
    )


def _open_files(process: Path) -> Iterator[str]:
    for descriptor in (process / "fd").iterdir():
        with suppress(FileNotFoundError):  # closed since
            yield re.sub(r":\[\d+\]", "", str(descriptor.readlink()))
