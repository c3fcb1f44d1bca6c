"""Measure a first start without stored kernels, a second one, memory after the first, and the idle server."""

import contextlib
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

import httpx

from foveacam_bench.doors.foreign import process_family
from foveacam_bench.figures import Figures
from foveacam_bench.servers import SERVE, free_port
from foveacam_hardware.contract import DeviceFault

POLL_S = 0.05
PATIENCE_S = 600.0
SETTLED_S = 5.0
"""After this time of being ready, a server is idle."""
IDLE_S, QUICK_IDLE_S = 30.0, 3.0
HTML = {"Accept": "text/html"}
_TICKS_PER_S = os.sysconf("SC_CLK_TCK")


@dataclass(frozen=True, slots=True, kw_only=True)
class StartTimes:
    """Times from the call of `foveacam serve`.

    `page_up_s`: any page; `console_up_s`: the console's own page; `ready_s`: `/readyz` says ready. None: not
    measured.
    """

    page_up_s: float | None = None
    console_up_s: float | None = None
    ready_s: float | None = None


class TimedServer:
    """A server whose start is timed; it ends with the context."""

    def __init__(self, folder: Path, *, kernels: Path | None, python: str = sys.executable) -> None:
        """`kernels`: folder of stored kernels, None: the usual; `python`: of the environment that serves."""
        port = free_port()
        self._url = f"http://127.0.0.1:{port}/"
        command = [part.format(port=port, data=folder / "data") for part in SERVE]
        environment = {**os.environ, **({} if kernels is None else {"NUMBA_CACHE_DIR": str(kernels)})}
        with (folder / "serve.log").open("a") as log:
            self._began_s = time.monotonic()
            self._process = subprocess.Popen(  # noqa: S603 - our own program
                [python, "-m", *command], stdout=log, stderr=subprocess.STDOUT, env=environment
            )

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.terminate()
        try:
            self._process.wait(10.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def times(self) -> StartTimes:
        """Wait until it is ready."""
        return StartTimes(
            page_up_s=self._until("", lambda answer: "text/html" in answer.headers.get("content-type", "")),
            console_up_s=self._until("", lambda answer: answer.status_code == 200),
            ready_s=self._until("readyz", lambda answer: answer.status_code == 200),
        )

    def resident_mb(self) -> float:
        """Return the resident memory of the server's own process, MB."""
        lines = Path(f"/proc/{self._process.pid}/status").read_text(encoding="ascii").splitlines()
        return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS:")) * 1024 / 1e6

    def cores(self, over_s: float) -> float:
        """Return how many cores the server and its children use, on average over a time."""
        before, began_s = _spent_s(self._process.pid), time.monotonic()
        time.sleep(over_s)
        return (_spent_s(self._process.pid) - before) / (time.monotonic() - began_s)

    def _until(self, path: str, met: Callable[[httpx.Response], bool]) -> float:
        """Return the time since the start at which an answer first met a condition."""
        with httpx.Client(trust_env=False, headers=HTML, timeout=PATIENCE_S) as http:
            while (spent_s := time.monotonic() - self._began_s) < PATIENCE_S:
                if self._process.poll() is not None:
                    raise DeviceFault("the bench's server has ended; see its serve.log")
                with contextlib.suppress(httpx.TransportError):
                    if met(http.get(self._url + path)):
                        return time.monotonic() - self._began_s
                time.sleep(POLL_S)
        raise DeviceFault(f"the bench's server did not answer {path or '/'} as wanted within {spent_s:.0f} s")


def _spent_s(pid: int) -> float:
    """Return the CPU time of a process and those that it has started, s."""
    ticks = 0
    for process in process_family(pid):
        with contextlib.suppress(OSError):  # it has just ended
            fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
            ticks += int(fields[11]) + int(fields[12])
    return ticks / _TICKS_PER_S


@contextmanager
def _empty_folders() -> Iterator[tuple[Path, Path]]:
    """Make a folder for the server's data, and one without kernels."""
    with tempfile.TemporaryDirectory(prefix="foveacam-start-") as name:
        kernels = Path(name) / "kernels"
        kernels.mkdir()
        yield Path(name), kernels


def _first_start(folder: Path, kernels: Path) -> tuple[StartTimes, float]:
    """Return the times of a start and the memory after it, MB."""
    with TimedServer(folder, kernels=kernels) as server:
        times = server.times()
        time.sleep(SETTLED_S)
        return times, server.resident_mb()


def measure_start(*, quick: bool = False) -> Figures:
    """Return the figures of a first and a second start, and of an idle server without a page.

    `quick`: no first start, whose figures are null; the second one uses the stored kernels.
    """
    with _empty_folders() as (folder, kernels):
        first, resident_mb = (StartTimes(), None) if quick else _first_start(folder, kernels)
        with TimedServer(folder, kernels=None if quick else kernels) as server:
            second = server.times()
            time.sleep(SETTLED_S)
            cores = server.cores(QUICK_IDLE_S if quick else IDLE_S)
    return {
        "page_up_s": first.page_up_s,
        "console_up_s": first.console_up_s,
        "ready_s": first.ready_s,
        "page_up_s_second": second.page_up_s,
        "console_up_s_second": second.console_up_s,
        "ready_s_second": second.ready_s,
        "rss_after_first_start_mb": resident_mb,
        "idle_cores": cores,
    }
